//! Ctrl-C and SIGTERM: the first asks the run to stop after its step, the second ends the program at once.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};

use crate::failure::{Failure, Message};

/// Exit code of an interrupted program.
pub const EXIT_CODE: u8 = 130;

/// Whether the user asked to stop.
#[derive(Clone, Debug)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// From now on signals are noticed. SIGHUP is not among them: a program under `nohup` goes on.
    ///
    /// # Errors
    /// The system refuses.
    pub fn install() -> Result<Self, Failure> {
        let refused = |error| Failure::Failed(Message::new(format!("cannot listen for signals: {error}")));
        let asked = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order: a signal ends the program if one came before, and is remembered otherwise.
            signal_hook::flag::register_conditional_shutdown(signal, i32::from(EXIT_CODE), Arc::clone(&asked))
                .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&asked)))
                .map_err(refused)?;
        }
        // A limit on the size of files comes with a signal that ends programs; without it the write fails instead, and
        // that is reported like a full disk.
        #[cfg(unix)]
        signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false))).map_err(refused)?;
        Ok(Self(asked))
    }

    /// A writer that refuses from the first signal on, so that what is half written is taken away as after any failure.
    pub fn guard<W: Write>(&self, inner: W) -> Guarded<W> {
        Guarded { inner, interrupt: self.clone() }
    }

    /// Whether a signal came.
    #[must_use]
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Refuses to write: the user asked to stop.
#[derive(Debug)]
pub struct Stopped;

impl std::fmt::Display for Stopped {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("interrupted")
    }
}

impl std::error::Error for Stopped {}

/// See [`Interrupt::guard`].
#[derive(Debug)]
pub struct Guarded<W> {
    inner: W,
    interrupt: Interrupt,
}

impl<W: Write> Write for Guarded<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.interrupt.asked() {
            return Err(io::Error::other(Stopped));
        }
        self.inner.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}
