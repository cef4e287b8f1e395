//! The output below the log's writer: counts what goes through and never seeks.

use std::io::{BufWriter, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts the bytes that its writer accepts. The count is shared, because the log's writer does not give access to
/// what it writes to.
pub struct Counting<W> {
    inner: W,
    bytes: Arc<AtomicU64>,
}

impl<W: Write> Write for Counting<W> {
    fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
        let written = self.inner.write(data)?;
        self.bytes.fetch_add(written as u64, Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.inner.flush()
    }
}

/// Records are written field by field; the buffer makes few system calls of that.
pub type Sink<W> = mcap::write::NoSeek<BufWriter<Counting<W>>>;

/// A sink, and the count of bytes that have left it.
pub fn sink<W: Write>(inner: W) -> (Sink<W>, Arc<AtomicU64>) {
    let bytes = Arc::new(AtomicU64::new(0));
    let counting = Counting { inner, bytes: Arc::clone(&bytes) };
    (mcap::write::NoSeek::new(BufWriter::with_capacity(128 * 1024, counting)), bytes)
}
