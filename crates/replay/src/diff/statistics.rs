//! Judging a chaotic run by its curves: against a band of reference runs, or within plain tolerances.
//!
//! Every curve has a mean per block of time. With N references, a run of the same kind lies beyond
//! t = |x - mean| / (s sqrt(1 + 1/N)) with the probability that Student's distribution of N - 1 degrees of freedom gives. Holm's correction keeps the
//! chance that anything at all is judged to differ, where nothing does, at the significance. Changes below 3 % of a curve are
//! never judged to differ, and curves that a single hot pair decides are reported without being judged.

use std::io::{Read, Seek};

use agglo_core::scene::Scene;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::curves::{BLOCKS, Curves, PROPORTIONAL, UNJUDGED};
use super::settings;
use super::tolerance::Tolerances;
use super::{First, Profile, Report, Setting, Structure, Verdict};
use crate::error::{Damage, LogError};
use crate::log::Log;

/// Reference runs that a band needs.
pub const LEAST_REFERENCES: usize = 5;

/// What a curve may differ by without a band, in shares of its largest value [-].
const PLAIN: f64 = 0.05;

/// Changes below this share of the mean are not judged to differ, however narrow the band: curves whose references happen
/// to agree closely have outliers that no few references show [-].
const LEAST_CHANGE: f64 = 0.03;

/// A curve in one block of time, judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Name of the curve.
    pub curve: &'static str,
    /// Start and end of the block [s].
    pub span: (f64, f64),
    /// Its mean in the run that is judged.
    pub value: f64,
    /// Mean of the references.
    pub mean: f64,
    /// The references' band; `None` without one.
    pub band: Option<Band>,
    /// Probability of a value this far out if nothing differs [-]; `None` without a band.
    pub probability: Option<f64>,
    /// What it may differ by from the mean, either way.
    pub allowed: f64,
    /// Whether it does not.
    pub passed: bool,
}

/// Mean and spread of references.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Whether both are of logarithms.
    pub log: bool,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub deviation: f64,
}

impl Band {
    fn back(&self, x: f64) -> f64 {
        if self.log { x.exp() } else { x }
    }
}

/// Curves against a band or tolerances.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistics {
    /// Reference runs.
    pub references: usize,
    /// Chance that a run in which nothing differs fails [-]; `None` without a band.
    pub significance: Option<f64>,
    /// Every curve in every block, the least likely first.
    pub judgements: Vec<Judgement>,
}

/// Compares the curves of log `a` with those of the references, the first of which is log B.
///
/// # Errors
/// A log that cannot be read, a device that fails.
pub fn judge<R: Read + Seek>(
    a: &mut Log<R>,
    references: &mut [Log<R>],
    significance: f64,
    mut tolerances: Tolerances,
) -> Result<Report, LogError> {
    let mut report = Report::new(Profile::Statistics);
    let (scene, judged) = (references[0].scene()?, a.scene()?);
    report.settings = settings::headers(a.run(), references[0].run());
    report.settings.extend(settings::scenes(&judged, &scene)?);
    let duration = scene.duration;
    let found = Curves::of(a, duration)?;
    let mut bands = Vec::new();
    for (k, reference) in references.iter_mut().enumerate() {
        let other = reference.scene()?;
        report.settings.extend(stray(k, &scene, &other)?);
        bands.push(Curves::of(reference, duration)?);
    }
    report.damage_a = found.damage.clone();
    for (k, band) in bands.iter().enumerate() {
        // The first is log B; the others have no name here.
        let whose = |what: &str| if k == 0 { what.to_owned() } else { format!("reference {}: {what}", k + 1) };
        let damage = band.damage.iter().map(|lost| Damage { offset: lost.offset, what: whose(&lost.what) });
        report.damage_b.extend(damage);
    }
    if let Some(why) = bands.iter().enumerate().find_map(|(k, band)| unfit(k, band, duration)) {
        return Ok(report.incomparable(why));
    }
    for (name, curves) in
        std::iter::once(("the log that is judged", &found)).chain(bands.iter().map(|c| ("a reference", c)))
    {
        if let Some((t, step)) = curves.not_finite {
            let what = format!("{name} has a state with a number that is not finite");
            report.structure.push(Structure { channel: "/particles".to_owned(), what, count: 1, t, step });
        }
        // Where the end is lost, the blocks that lack it are said.
        if !ends_with(curves.end, duration) && !curves.lost.is_some_and(|(_, last)| last == f64::INFINITY) {
            let what = format!("{name} ends at t = {} s instead of {duration} s", curves.end);
            report.not_compared.push(what);
        }
    }
    let with_band = bands.len() >= LEAST_REFERENCES;
    let (mut judgements, mut unjudged) = (Vec::new(), Vec::new());
    for curve in &bands[0].curves {
        let tolerance = tolerances.of(&format!("curves.{}", curve.name), "");
        if tolerance.ignore {
            continue;
        }
        let Some(own) = found.get(curve.name) else {
            let what = format!("the first log has no curve {}", curve.name);
            report.structure.push(Structure { channel: String::new(), what, count: 1, t: 0.0, step: 0 });
            continue;
        };
        let peak = curve.blocks.iter().filter(|v| v.is_finite()).fold(0.0_f64, |peak, v| peak.max(v.abs()));
        let mut start = 0.0;
        for (k, share) in BLOCKS.iter().enumerate() {
            let span = (start * duration, share * duration);
            start = *share;
            let values: Vec<f64> = bands.iter().filter_map(|band| Some(band.get(curve.name)?.blocks[k])).collect();
            if found.lacks(curve.name, span) {
                unjudged.push((curve.name, span));
                continue;
            }
            let own = own.blocks[k];
            judgements.push(if with_band {
                against_band(curve.name, span, own, &values)
            } else {
                let given = tolerances.given;
                let allowed = if given { tolerance.abs + tolerance.rel * peak } else { PLAIN * peak };
                within(curve.name, span, own, values[0], allowed)
            });
        }
    }
    for curve in found.curves.iter().filter(|curve| bands[0].get(curve.name).is_none()) {
        if !tolerances.of(&format!("curves.{}", curve.name), "").ignore {
            let what = format!("the references have no curve {}", curve.name);
            report.structure.push(Structure { channel: String::new(), what, count: 1, t: 0.0, step: 0 });
        }
    }
    let mut significance = Some(significance);
    match significance.filter(|_| with_band) {
        Some(level) => holm(&mut judgements, level, bands.len()),
        None => significance = None,
    }
    judgements.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    if let Some(worst) =
        judgements.iter().filter(|judgement| !judgement.passed).min_by(|a, b| a.span.0.total_cmp(&b.span.0))
    {
        let Judgement { curve, span, value, mean, .. } = worst;
        let what = format!("curves.{curve} is {value} instead of {mean} from t = {} s to {} s", span.0, span.1);
        let channel = format!("curves.{curve}");
        report.first = Some(First { t: span.0, step: None, channel, value: None, what });
    }
    report.compared_steps = found.frames;
    report.ignored = tolerances.ignored();
    let unmatched: Vec<String> =
        tolerances.unmatched().into_iter().filter(|name| name.starts_with("curves.")).collect();
    let failed = judgements.iter().any(|judgement| !judgement.passed) || !report.structure.is_empty();
    if failed || !report.not_compared.is_empty() {
        report.verdict = Verdict::Differ;
    }
    // Said, and no difference: that a part is lost is damage.
    for (curve, (from, to)) in &unjudged {
        report
            .not_compared
            .push(format!("curves.{curve} from t = {from} s to {to} s: a part of the log is lost there"));
    }
    if judgements.is_empty() && !unjudged.is_empty() {
        let why = "of the log that is judged, so much is lost that no curve is whole";
        report.verdict = Verdict::Incomparable(why.to_owned());
    }
    if let [first, ..] = &unmatched[..] {
        report.verdict = Verdict::Incomparable(format!("the tolerance for `{first}` matches no curve"));
    }
    report.statistics = Some(Statistics { references: bands.len(), significance, judgements });
    Ok(report)
}

/// In what the scene of a reference differs from that of the first, seeds apart: the band then is one of other runs.
fn stray(number: usize, first: &Scene, other: &Scene) -> Result<Vec<Setting>, LogError> {
    let mut found = settings::scenes(other, first)?;
    found.retain(|setting| setting.kind == settings::Kind::Physics && setting.name != "/seed");
    for setting in &mut found {
        setting.name = format!("reference {}: {}", number + 1, setting.name);
    }
    Ok(found)
}

/// Why a reference cannot judge anything: a part of it is lost, or it ends elsewhere than its scene.
fn unfit(k: usize, reference: &Curves, duration: f64) -> Option<String> {
    let name = if k == 0 { "the second log".to_owned() } else { format!("reference {}", k + 1) };
    match reference.lost {
        Some((from, to)) if to.is_finite() => Some(format!("a part of {name} is lost between t = {from} s and {to} s")),
        Some((from, _)) => Some(format!("the end of {name} is lost from t = {from} s on")),
        None if ends_with(reference.end, duration) => None,
        None => Some(format!("{name} ends at t = {} s instead of {duration} s", reference.end)),
    }
}

/// Whether a log whose last state is at `end` [s] reaches the duration; an end that is no number reaches none.
fn ends_with(end: f64, duration: f64) -> bool {
    (end - duration).abs() <= 1e-6 * duration
}

fn rank(judgement: &Judgement) -> f64 {
    let excess = (judgement.value - judgement.mean).abs() / judgement.allowed.max(f64::MIN_POSITIVE);
    judgement.probability.unwrap_or(-excess)
}

fn within(curve: &'static str, span: (f64, f64), value: f64, mean: f64, allowed: f64) -> Judgement {
    let both_nothing = value.is_nan() && mean.is_nan();
    let passed = both_nothing || (value - mean).abs() <= allowed;
    Judgement { curve, span, value, mean, band: None, probability: None, allowed, passed }
}

fn against_band(curve: &'static str, span: (f64, f64), value: f64, values: &[f64]) -> Judgement {
    let positive = |v: &f64| *v > 0.0;
    let log = PROPORTIONAL.contains(&curve) && positive(&value) && values.iter().all(positive);
    let scaled = |v: f64| if log { v.ln() } else { v };
    let values: Vec<f64> = values.iter().map(|v| scaled(*v)).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let apart = (scaled(value) - mean).abs();
    let nothing = values.iter().all(|v| v.is_nan());
    let probability = if UNJUDGED.contains(&curve) {
        1.0
    } else if nothing {
        // Nothing happens in this block, in no run.
        if value.is_nan() { 1.0 } else { 0.0 }
    } else if deviation.is_nan() || value.is_nan() || apart <= least_change(log, mean) {
        // Something happens in some runs only: the curve says nothing here.
        1.0
    } else if deviation == 0.0 {
        0.0
    } else {
        let t = apart / (deviation * (1.0 + 1.0 / n).sqrt());
        student(n - 1.0).map_or(1.0, |student| 2.0 * student.cdf(-t))
    };
    let band = Band { log, mean, deviation };
    Judgement {
        curve,
        span,
        value,
        mean: band.back(mean),
        band: Some(band),
        probability: Some(probability),
        allowed: 0.0,
        passed: true,
    }
}

/// The change that is not judged to differ, in the band's own scale.
fn least_change(log: bool, mean: f64) -> f64 {
    if log { LEAST_CHANGE } else { LEAST_CHANGE * mean.abs() }
}

fn student(freedom: f64) -> Option<StudentsT> {
    StudentsT::new(0.0, 1.0, freedom).ok()
}

/// The distance from the middle beyond which the distribution has a share `tail` on one side. The library's own inverse
/// panics for shares near zero; this one bisects the logarithm of the distance.
fn quantile(student: &StudentsT, tail: f64) -> f64 {
    let (mut near, mut far) = (-50.0_f64, 700.0_f64);
    for _ in 0..64 {
        let middle = 0.5 * (near + far);
        if student.cdf(-middle.exp()) > tail { near = middle } else { far = middle }
    }
    (0.5 * (near + far)).exp()
}

/// Holm's step-down procedure: the k-th least likely of m must be less likely than significance / (m - k + 1).
fn holm(judgements: &mut [Judgement], significance: f64, references: usize) {
    judgements.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    let m = judgements.len();
    let n = references as f64;
    let mut rejecting = true;
    for (k, judgement) in judgements.iter_mut().enumerate() {
        let level = significance / (m - k) as f64;
        rejecting &= judgement.probability.is_some_and(|p| p < level);
        judgement.passed = !rejecting;
        let quantile = student(n - 1.0).map_or(f64::INFINITY, |student| quantile(&student, 0.5 * level));
        let Some(band) = judgement.band else { continue };
        let width = (band.deviation * (1.0 + 1.0 / n).sqrt() * quantile).max(least_change(band.log, band.mean));
        judgement.allowed = band.back(band.mean + width) - band.back(band.mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_judged_by_students_distribution() {
        // Mean 10, deviation 1 of five values: at t = 4.604 the two-sided probability is 1 % for four degrees of freedom
        // (tabulated); sqrt(1 + 1/5) widens the band.
        let values = [10.0 - 1.264_911_064, 10.0, 10.0, 10.0, 10.0 + 1.264_911_064];
        let deviation = (2.0 * 1.264_911_064_f64.powi(2) / 4.0).sqrt();
        let judged = against_band("kinetic", (0.0, 1.0), 10.0 + 4.604 * deviation * 1.2_f64.sqrt(), &values);
        assert!((judged.probability.unwrap() - 0.01).abs() < 1e-5, "{judged:?}");
    }

    #[test]
    fn holm_lets_one_in_a_hundred_pass_more_easily_than_a_single_one() {
        let judgement = |p: f64| Judgement {
            curve: "kinetic",
            span: (0.0, 1.0),
            value: 0.0,
            mean: 0.0,
            band: Some(Band { log: false, mean: 0.0, deviation: 1.0 }),
            probability: Some(p),
            allowed: 0.0,
            passed: true,
        };
        let mut one = vec![judgement(0.009)];
        holm(&mut one, 0.01, 8);
        assert!(!one[0].passed);
        let mut many: Vec<Judgement> = (0..100).map(|k| judgement(if k == 0 { 0.009 } else { 0.5 })).collect();
        holm(&mut many, 0.01, 8);
        assert!(many.iter().all(|judgement| judgement.passed));
    }

    #[test]
    fn quantiles_of_every_share_are_numbers() {
        let student = student(4.0).unwrap();
        for (tail, expected) in [(0.005, 4.604_094_871), (0.025, 2.776_445_105), (0.25, 0.740_697_084)] {
            let found = quantile(&student, tail);
            assert!((found - expected).abs() < 1e-8, "{found} instead of the tabulated {expected}");
        }
        let mut before = 0.0;
        for tail in [0.5 * (1.0 - f64::EPSILON), 1e-9, 1e-100, 1e-300, f64::MIN_POSITIVE, 5e-324] {
            let found = quantile(&student, tail);
            assert!(found.is_finite() && found > before, "{tail}: {found}");
            before = found;
        }
    }

    #[test]
    fn curves_without_spread_must_be_met() {
        assert_eq!(against_band("heat", (0.0, 1.0), 2.0, &[2.0; 6]).probability, Some(1.0));
        assert_eq!(against_band("heat", (0.0, 1.0), 2.1, &[2.0; 6]).probability, Some(0.0));
        assert_eq!(against_band("heat", (0.0, 1.0), 2.05, &[2.0; 6]).probability, Some(1.0), "below 3 %");
        assert_eq!(against_band("heat", (0.0, 1.0), f64::NAN, &[f64::NAN; 6]).probability, Some(1.0));
    }
}
