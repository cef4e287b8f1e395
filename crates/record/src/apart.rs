//! A file that is written on a thread of its own, so that compressing and writing overlap with solving.
//!
//! A few batches of messages go round: filled here, written there, and filled again. When all are under way the solver
//! waits for the output. The file gets the same messages and chunks in the same order, hence the same bytes.

use std::io::Write;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use crate::channels::Topic;
use crate::container::{Container, Totals};
use crate::encoder::Encoded;
use crate::error::RecordError;

/// Batches that go round: one is filled, one is written, one waits.
const BATCHES: usize = 3;

/// Size at which a batch leaves [bytes]: rarely enough that handing over costs nothing.
const BATCH: usize = 128 * 1024;

/// Messages on their way to the file.
#[derive(Debug, Default)]
struct Batch {
    /// All of them, one behind the other.
    data: Vec<u8>,
    /// Channel, log time [ns], and where the message ends in `data`.
    messages: Vec<(Topic, u64, usize)>,
    /// Whether the chunk is to be closed behind them.
    flush: bool,
}

impl Batch {
    fn write<W: Write>(&mut self, container: &mut Container<W>) -> Result<(), RecordError> {
        let mut start = 0;
        for &(topic, log_time, end) in &self.messages {
            container.send(Encoded { topic, log_time, data: &self.data[start..end] })?;
            start = end;
        }
        if self.flush {
            container.flush()?;
        }
        self.data.clear();
        self.messages.clear();
        self.flush = false;
        Ok(())
    }
}

/// The near end of the thread.
pub struct Apart {
    batch: Batch,
    /// `None` once no more will come.
    full: Option<Sender<Batch>>,
    empty: Receiver<Batch>,
    /// Batches that have not come back.
    under_way: usize,
    /// `None` once it has ended and what it came to is known.
    thread: Option<JoinHandle<Result<Totals, RecordError>>>,
}

impl Apart {
    /// Takes a file to a thread of its own.
    ///
    /// # Errors
    /// A thread that the operating system refuses.
    pub fn new<W: Write + Send + 'static>(mut container: Container<W>) -> Result<Self, RecordError> {
        let (full, batches) = channel::<Batch>();
        let (back, empty) = channel();
        let write = move || {
            for mut batch in batches {
                batch.write(&mut container)?;
                // Nobody waits for the last ones.
                _ = back.send(batch);
            }
            container.finish()
        };
        let thread =
            std::thread::Builder::new().name("recorder".to_owned()).spawn(write).map_err(RecordError::Write)?;
        Ok(Self { batch: Batch::default(), full: Some(full), empty, under_way: 0, thread: Some(thread) })
    }

    /// Puts a message into the batch.
    pub fn send(&mut self, message: Encoded<'_>) -> Result<(), RecordError> {
        let Encoded { topic, log_time, data } = message;
        self.batch.data.extend_from_slice(data);
        self.batch.messages.push((topic, log_time, self.batch.data.len()));
        if self.batch.data.len() < BATCH { Ok(()) } else { self.hand_over() }
    }

    /// Has the chunk closed behind what was sent so far.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        self.batch.flush = true;
        self.hand_over()
    }

    /// Waits until all that was handed over has left for the output.
    pub fn wait(&mut self) -> Result<(), RecordError> {
        while self.under_way > 0 {
            self.batch_back()?;
        }
        Ok(())
    }

    /// Completes the file.
    pub fn finish(&mut self) -> Result<Totals, RecordError> {
        self.hand_over()?;
        self.end()
    }

    fn hand_over(&mut self) -> Result<(), RecordError> {
        let next = if self.under_way + 1 < BATCHES { Batch::default() } else { self.batch_back()? };
        let full = std::mem::replace(&mut self.batch, next);
        match &self.full {
            Some(sender) if sender.send(full).is_ok() => {
                self.under_way += 1;
                Ok(())
            }
            _ => self.end().map(drop),
        }
    }

    /// The next batch that comes back.
    fn batch_back(&mut self) -> Result<Batch, RecordError> {
        match self.empty.recv() {
            Ok(batch) => {
                self.under_way -= 1;
                Ok(batch)
            }
            Err(_) => self.end().map(|_| Batch::default()),
        }
    }

    /// Lets the thread end, and says what it came to. A thread that ends early does so with an error.
    fn end(&mut self) -> Result<Totals, RecordError> {
        self.full = None;
        match self.thread.take() {
            Some(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            None => Err(RecordError::AfterFailure("its thread has ended".to_owned())),
        }
    }
}

impl Drop for Apart {
    fn drop(&mut self) {
        // A log that nobody finishes gets what was recorded all the same.
        if let (Some(thread), Some(full)) = (self.thread.take(), self.full.take()) {
            _ = full.send(std::mem::take(&mut self.batch));
            drop(full);
            _ = thread.join();
        }
    }
}
