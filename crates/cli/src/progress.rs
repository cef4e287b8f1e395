//! Progress of a run on standard error: a bar on a terminal, a JSON line a second on request, else nothing.

use std::time::{Duration, Instant};

use agglo_core::StepReport;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::args::ProgressKind;
use crate::numbers::counted;
use crate::terminal::Terminal;

/// The whole line is one message: setting a position as well would draw every update twice.
const TEMPLATE: &str = "{wide_msg}";
/// Length of the bar [characters].
const BAR: usize = 12;
/// Time between redraws of the bar.
const REDRAW: Duration = Duration::from_millis(50);
/// Time from which on the pace so far tells when a run ends.
const SETTLED: Duration = Duration::from_millis(500);
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
                let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
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
        self.update(Numbers {
            time: report.time,
            step: report.step,
            dt: report.diagnostics.map(|d| d.dt),
            iterations: report.diagnostics.map(|d| d.iterations()),
        });
    }

    /// Shows a step that is carried over from an earlier log.
    pub fn carried(&mut self, time: f64, step: u64) {
        if !matches!(self.show, Show::Nothing) {
            self.update(Numbers { time, step, dt: None, iterations: None });
        }
    }

    fn update(&mut self, numbers: Numbers) {
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
                // Asked every time: a terminal may change its width.
                let columns = console::Term::stderr().size_checked().map_or(80, |(_, columns)| columns);
                bar.set_message(self.text(numbers, columns.into()));
            }
            Show::Lines => self.terminal.json(&self.line(numbers)),
        }
    }

    /// As much of it as fits into a line of so many columns, the most important first; a bar where there is room.
    fn text(&self, numbers: &Numbers, columns: usize) -> String {
        let done = (numbers.time / self.duration).clamp(0.0, 1.0);
        // What is left is not known from the first moments.
        let left = self.remaining(numbers).filter(|_| self.started.elapsed() >= SETTLED).and_then(|left| {
            let left = Duration::try_from_secs_f64(left).ok()?;
            Some(format!("{:#}", HumanDuration(left)))
        });
        let mut text = format!("{:>3} %  t {:.4} of {} s", (done * 100.0) as u64, numbers.time, self.duration);
        let parts = [
            Some(format!("{} left", left.as_deref().unwrap_or("-"))),
            numbers.dt.map(|dt| format!("dt {dt:.1e} s")),
            numbers.iterations.map(|iterations| format!("{iterations} iter.")),
            self.clusters.map(|clusters| counted(clusters.into(), "cluster")),
        ];
        for part in parts.into_iter().flatten() {
            if text.len() + 2 + part.len() > columns {
                return text;
            }
            text = format!("{text}  {part}");
        }
        if text.len() + 1 + BAR <= columns {
            let full = (done * BAR as f64) as usize;
            text = format!("{}{} {text}", "█".repeat(full), "░".repeat(BAR - full));
        }
        text
    }

    /// Time to the end at the pace so far [s]; `None` before the first step.
    fn remaining(&self, numbers: &Numbers) -> Option<f64> {
        let done = numbers.time / self.duration;
        (done > 0.0).then(|| self.started.elapsed().as_secs_f64() * (1.0 - done).max(0.0) / done)
    }

    fn line(&self, numbers: &Numbers) -> serde_json::Value {
        let elapsed = self.started.elapsed().as_secs_f64();
        let remaining = self.remaining(numbers);
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
        let mut progress = progress(ProgressKind::Never);
        let all = " 25 %  t 1.2500 of 5 s  - left  dt 1.0e-3 s  2 iter.  3 clusters";
        assert_eq!(progress.text(&NUMBERS, 80), format!("███░░░░░░░░░ {all}"));
        assert_eq!(progress.text(&NUMBERS, 70), all);
        assert_eq!(progress.text(&NUMBERS, 40), " 25 %  t 1.2500 of 5 s  - left");
        assert_eq!(progress.text(&NUMBERS, 1), " 25 %  t 1.2500 of 5 s", "never without the time");
        let Some(started) = progress.started.checked_sub(Duration::from_secs(4)) else { return };
        progress.started = started;
        assert!(progress.text(&NUMBERS, 80).contains("12s left"), "{}", progress.text(&NUMBERS, 80));
    }

    #[test]
    fn a_line_is_json_with_the_time_left() {
        let line = progress(ProgressKind::Json).line(&NUMBERS);
        let (elapsed, left) = (line["elapsed_seconds"].as_f64().unwrap(), line["remaining_seconds"].as_f64().unwrap());
        // A quarter is done, so three times as much is left; the clock is read twice, microseconds apart.
        assert!((left - 3.0 * elapsed).abs() <= 0.1, "{line}");
        assert_eq!((&line["step"], &line["clusters"]), (&7.into(), &3.into()));
    }

    #[test]
    fn the_template_is_readable() {
        assert!(ProgressStyle::with_template(TEMPLATE).is_ok());
    }
}
