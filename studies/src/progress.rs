//! A counter of finished runs on stderr, where that is a terminal.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Counts finished runs.
#[derive(Debug)]
pub struct Progress {
    total: usize,
    finished: AtomicUsize,
    visible: bool,
}

impl Progress {
    /// For so many runs.
    #[must_use]
    pub fn new(total: usize) -> Self {
        Self { total, finished: AtomicUsize::new(0), visible: std::io::stderr().is_terminal() }
    }

    /// One more is finished.
    pub fn done(&self) {
        let finished = self.finished.fetch_add(1, Ordering::Relaxed) + 1;
        if self.visible {
            let end = if finished == self.total { "\n" } else { "" };
            // Progress that cannot be shown is no reason to stop.
            let _ = write!(std::io::stderr(), "\r{finished} of {} runs{end}", self.total);
        }
    }
}
