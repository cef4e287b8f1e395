//! A comparison as JSON.

use agglo_replay::diff::{FieldReport, Judgement, Report, Statistics, Verdict};
use serde_json::{Value, json};

use super::Names;
use crate::numbers::exact;

/// The object of `--json`, with a line end.
pub fn report(names: Names<'_>, report: &Report) -> String {
    format!("{:#}\n", object(names, report))
}

/// A word for a verdict.
pub fn verdict(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Same => "same",
        Verdict::Differ => "differ",
        Verdict::Incomparable(_) => "incomparable",
    }
}

fn object(names: Names<'_>, report: &Report) -> Value {
    let reason = if let Verdict::Incomparable(why) = &report.verdict { json!(why) } else { Value::Null };
    let settings = report.settings.iter();
    let settings = settings.map(|s| json!({ "name": s.name, "a": s.a, "b": s.b, "kind": s.kind.name() }));
    let structure = report.structure.iter();
    let structure = structure
        .map(|s| json!({ "channel": s.channel, "what": s.what, "count": s.count, "t": exact(s.t), "step": s.step }));
    let damage = |damage: &[agglo_replay::Damage]| -> Vec<Value> {
        damage.iter().map(|lost| json!({ "offset": lost.offset, "what": lost.what })).collect()
    };
    json!({
        "format": 1, "verdict": verdict(&report.verdict), "reason": reason, "damaged": report.damaged(),
        "profile": report.profile.name(), "a": names.a, "b": names.b,
        "settings": settings.collect::<Vec<_>>(),
        "compared_steps": report.compared_steps, "by_time_from": report.by_time_from.map(exact),
        "first_difference": first(report),
        "just_before": report.cause.as_ref().map(ToString::to_string),
        "fields": report.fields.iter().map(field).collect::<Vec<_>>(),
        "structure": structure.collect::<Vec<_>>(),
        "not_compared": report.not_compared, "drawn_not_compared": report.drawn, "ignored": report.ignored,
        "growth_rate": report.growth.map(|growth| exact(growth.rate)),
        "growth": report.growth.map(|growth| json!({
            "rate": exact(growth.rate), "error": exact(growth.error), "from": exact(growth.span.0), "to": exact(growth.span.1)
        })),
        "statistics": report.statistics.as_ref().map(statistics),
        "damage": { "a": damage(&report.damage_a), "b": damage(&report.damage_b) },
    })
}

fn first(report: &Report) -> Value {
    let Some(first) = &report.first else { return Value::Null };
    let mut object = json!({
        "t": exact(first.t), "step": first.step, "channel": first.channel, "field": null, "particle": null, "index": null,
        "a": null, "b": null, "abs": null, "rel": null, "ulp": null, "what": first.what,
    });
    if let Some(value) = &first.value {
        let field =
            value.field.strip_prefix(&first.channel).map_or(value.field.as_str(), |f| f.trim_start_matches('.'));
        object["field"] = field.into();
        object["particle"] = json!(value.index.filter(|_| value.is_particle));
        object["index"] = json!(value.index);
        object["a"] = value.a.clone();
        object["b"] = value.b.clone();
        object["abs"] = value.abs.map_or(Value::Null, exact);
        object["rel"] = value.rel.map_or(Value::Null, exact);
        object["ulp"] = json!(value.ulp);
    }
    object
}

fn field(field: &FieldReport) -> Value {
    let at = field.at.map(|(t, step, index)| {
        json!({ "t": exact(t), "step": step, "particle": field.is_particle().then_some(index), "index": index })
    });
    json!({
        "channel": field.channel, "field": field.field, "max_abs": exact(field.max_abs), "max_rel": exact(field.max_rel),
        "rms": exact(field.rms()), "max_ulp": field.max_ulp, "at": at,
        "tolerance": { "abs": exact(field.tolerance.abs), "rel": exact(field.tolerance.rel) }, "passed": field.passed,
    })
}

fn statistics(statistics: &Statistics) -> Value {
    let judgement = |judgement: &Judgement| {
        json!({
            "curve": judgement.curve, "from": exact(judgement.span.0), "to": exact(judgement.span.1),
            "value": exact(judgement.value), "mean": exact(judgement.mean),
            "deviation": judgement.band.map(|band| exact(band.deviation)),
            "logarithmic": judgement.band.map(|band| band.log), "probability": judgement.probability.map(exact),
            "allowed": exact(judgement.allowed), "passed": judgement.passed,
        })
    };
    json!({
        "references": statistics.references, "significance": statistics.significance.map(exact),
        "curves": statistics.judgements.iter().map(judgement).collect::<Vec<_>>(),
    })
}
