//! Progress of a run on standard error: a bar on a terminal, a JSON line a second on request, else nothing.

use std::time::{Duration, Instant};

use agglo_core::StepReport;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::args::ProgressKind;
use crate::numbers::counted;
use crate::terminal::Terminal;

/// Length of the bar: simulated time counts in these parts of the duration.
const PARTS: f64 = 1e6;
/// What the bar looks like; it fits into 80 columns.
const TEMPLATE: &str = "{bar:12} {percent:>3} %  {eta} left  {wide_msg}";
/// Time between redraws of the bar.
const REDRAW: Duration = Duration::from_millis(50);
/// Time between JSON lines.
const LINE: Duration = Duration::from_secs(1);

/// Shows how far a run is.
#[derive(Debug)]
pub struct Progress {
    show: Show,
    terminal: Terminal,
    duration: f64,
    started: Instant,
    shown: Instant,
    last: Option<Numbers>,
    clusters: Option<u32>,
}

#[derive(Debug)]
enum Show {
    Nothing,
    Bar(ProgressBar),
    Lines,
}

/// What is shown of a step.
#[derive(Clone, Copy, Debug)]
struct Numbers {
    time: f64,
    step: u64,
    dt: Option<f64>,
    iterations: Option<u64>,
}

impl Progress {
    /// Progress towards `duration` [s].
    #[must_use]
    pub fn new(terminal: &Terminal, duration: f64) -> Self {
        let show = match terminal.progress {
            ProgressKind::Json => Show::Lines,
            _ if terminal.draws_bar() => {
                let bar = ProgressBar::with_draw_target(Some(PARTS as u64), ProgressDrawTarget::stderr());
                // The default style stands in for a template that cannot be read, which a test rules out.
                bar.set_style(ProgressStyle::with_template(TEMPLATE).unwrap_or_else(|_| ProgressStyle::default_bar()));
                Show::Bar(bar)
            }
            _ => Show::Nothing,
        };
        let now = Instant::now();
        Self { show, terminal: *terminal, duration, started: now, shown: now, last: None, clusters: None }
    }

    /// Shows a step, unless the last one was shown only just now.
    pub fn step(&mut self, report: &StepReport<'_>) {
        if matches!(self.show, Show::Nothing) {
            return;
        }
        if let Some(clusters) = report.sample.and_then(|sample| sample.clusters.as_ref()) {
            self.clusters = Some(clusters.count);
        }
        let numbers = Numbers {
            time: report.time,
            step: report.step,
            dt: report.diagnostics.map(|d| d.dt),
            iterations: report.diagnostics.map(|d| d.iterations()),
        };
        self.last = Some(numbers);
        let pause = if matches!(self.show, Show::Lines) { LINE } else { REDRAW };
        let now = Instant::now();
        if now - self.shown >= pause {
            self.shown = now;
            self.show(&numbers);
        }
    }

    /// Shows the last step; a bar is wiped, because a summary follows.
    pub fn finish(&mut self) {
        match (&self.show, self.last) {
            (Show::Bar(bar), _) => bar.finish_and_clear(),
            (Show::Lines, Some(numbers)) => self.show(&numbers),
            _ => {}
        }
    }

    /// Lets something else be written to the terminal.
    pub fn aside(&self, write: impl FnOnce()) {
        match &self.show {
            Show::Bar(bar) => bar.suspend(write),
            _ => write(),
        }
    }

    fn show(&self, numbers: &Numbers) {
        match &self.show {
            Show::Nothing => {}
            Show::Bar(bar) => {
                bar.set_message(self.message(numbers));
                bar.set_position((numbers.time / self.duration * PARTS) as u64);
            }
            Show::Lines => self.terminal.json(&self.line(numbers)),
        }
    }

    fn message(&self, numbers: &Numbers) -> String {
        use std::fmt::Write;
        let mut message = format!("t {:.4} of {} s", numbers.time, self.duration);
        if let Some(dt) = numbers.dt {
            _ = write!(message, "  dt {dt:.1e} s");
        }
        if let Some(iterations) = numbers.iterations {
            _ = write!(message, "  {iterations} iter.");
        }
        if let Some(clusters) = self.clusters {
            _ = write!(message, "  {}", counted(clusters.into(), "cluster"));
        }
        message
    }

    fn line(&self, numbers: &Numbers) -> serde_json::Value {
        let elapsed = self.started.elapsed().as_secs_f64();
        let done = numbers.time / self.duration;
        let remaining = (done > 0.0).then(|| elapsed * (1.0 - done).max(0.0) / done);
        serde_json::json!({
            "type": "progress", "time": numbers.time, "duration": self.duration, "step": numbers.step, "dt": numbers.dt,
            "iterations": numbers.iterations, "clusters": self.clusters, "elapsed_seconds": elapsed,
            "remaining_seconds": remaining,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::ErrorFormat;

    fn progress(kind: ProgressKind) -> Progress {
        let terminal = Terminal { quiet: false, verbose: false, errors: ErrorFormat::Text, progress: kind };
        let mut progress = Progress::new(&terminal, 5.0);
        progress.clusters = Some(3);
        progress
    }

    const NUMBERS: Numbers = Numbers { time: 1.25, step: 7, dt: Some(1e-3), iterations: Some(2) };

    #[test]
    fn a_bar_says_time_step_iterations_clusters() {
        let message = progress(ProgressKind::Never).message(&NUMBERS);
        assert_eq!(message, "t 1.2500 of 5 s  dt 1.0e-3 s  2 iter.  3 clusters");
    }

    #[test]
    fn a_line_is_json_with_the_time_left() {
        let line = progress(ProgressKind::Json).line(&NUMBERS);
        let (elapsed, left) = (line["elapsed_seconds"].as_f64().unwrap(), line["remaining_seconds"].as_f64().unwrap());
        // A quarter is done, so three times as much is left, to round-off.
        assert!((left - 3.0 * elapsed).abs() <= 1e-12 * left, "{line}");
        assert_eq!((&line["step"], &line["clusters"]), (&7.into(), &3.into()));
    }

    #[test]
    fn the_template_is_readable() {
        assert!(ProgressStyle::with_template(TEMPLATE).is_ok());
    }
}
