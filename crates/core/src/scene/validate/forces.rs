//! Near field, binding and the count of clusters.

use crate::scene::{Cutoff, NamedCutoff, NearField, Problem, Scene, Weight};

impl NearField {
    /// Distance d* of the inflection of the potential, (beta2 alpha2/(beta1 alpha1))^(1/(beta2 - beta1)), equation (12)
    /// [m]; `None` where a term is missing.
    #[must_use]
    pub fn inflection(&self) -> Option<f64> {
        let (a, r) = (self.attraction.as_ref()?, self.repulsion.as_ref()?);
        let ratio = (r.exponent * r.strength) / (a.exponent * a.strength);
        Some(libm::pow(ratio, 1.0 / (r.exponent - a.exponent)))
    }

    /// Distance beyond which the near field is zero [m]; `None` without a cut-off.
    #[must_use]
    pub fn cutoff_distance(&self) -> Option<f64> {
        match self.cutoff {
            Cutoff::Distance(distance) => Some(distance),
            Cutoff::Named(NamedCutoff::Inflection) => self.inflection(),
            Cutoff::Named(NamedCutoff::None) => None,
        }
    }
}

pub(super) fn check(scene: &Scene, problems: &mut Vec<Problem>) {
    if let Some(field) = &scene.near_field {
        check_near_field(field, problems);
    }
    if scene.binding.is_some() && scene.clusters.is_some() {
        problems.push(
            Problem::new("/clusters", "binding defines the clusters: bonded particles belong together")
                .hint("leave \"clusters\" out"),
        );
    }
}

fn check_near_field(field: &NearField, problems: &mut Vec<Problem>) {
    if field.attraction.is_none() && field.repulsion.is_none() {
        problems.push(
            Problem::new("/near_field", "the near field has neither attraction nor repulsion")
                .hint("add one of them, or leave \"near_field\" out"),
        );
    }
    if field.accuracy.is_some() && field.cutoff != Cutoff::default() {
        problems.push(
            Problem::new("/near_field/accuracy", "a long-range method is for a near field without a cut-off")
                .hint("leave \"accuracy\" out: pairs inside the cut-off are summed exactly"),
        );
    }
    let inflection = field.cutoff == Cutoff::Named(NamedCutoff::Inflection);
    let before = problems.len();
    if inflection {
        check_inflection(field, problems);
    }
    let Some(switch_from) = field.switch_from else { return };
    match field.cutoff_distance() {
        None if !inflection => problems.push(
            Problem::new("/near_field/switch_from", "switch_from needs a cut-off, which this near field has not")
                .hint("add \"cutoff\" [m] beyond switch_from"),
        ),
        Some(cutoff) if problems.len() == before && switch_from >= cutoff => problems.push(Problem::new(
            "/near_field/switch_from",
            format!("switch_from must be less than the cut-off of {cutoff} m, not {switch_from}"),
        )),
        _ => {}
    }
}

/// The inflection exists where the potential has one well, the same for every pair.
fn check_inflection(field: &NearField, problems: &mut Vec<Problem>) {
    let pointer = "/near_field/cutoff";
    let hint = "give the cut-off in metres, or \"none\"";
    let (Some(a), Some(r)) = (&field.attraction, &field.repulsion) else {
        let missing = if field.attraction.is_none() { "attraction" } else { "repulsion" };
        let message = format!("the cut-off \"inflection\" needs both terms, but there is no {missing}");
        return problems.push(Problem::new(pointer, message).hint(hint));
    };
    let weights = [a.weight.unwrap_or(field.weight), r.weight.unwrap_or(field.weight)];
    if weights.contains(&Weight::ChargeProduct) {
        let message = "the cut-off \"inflection\" excludes the weight \"charge-product\": pairs that repel have none";
        problems.push(Problem::new(pointer, message).hint(hint));
    } else if weights[0] != weights[1] {
        let message =
            "the cut-off \"inflection\" needs the same weight in both terms: else it differs from pair to pair";
        problems.push(Problem::new(pointer, message).hint(hint));
    }
    for (term, name) in [(a, "attraction"), (r, "repulsion")] {
        if term.strength == 0.0 {
            let message =
                format!("the cut-off \"inflection\" needs a strength greater than 0 in both terms, not 0 in {name}");
            problems.push(Problem::new(format!("/near_field/{name}/strength"), message).hint(hint));
        }
    }
    if a.exponent == 0.0 {
        let message =
            "the cut-off \"inflection\" needs an attraction exponent greater than 0: a constant force has none";
        return problems.push(Problem::new("/near_field/attraction/exponent", message).hint(hint));
    }
    if r.exponent <= a.exponent {
        let message = format!(
            "the cut-off \"inflection\" needs a repulsion exponent greater than the attraction's, {}, not {}",
            a.exponent, r.exponent
        );
        problems.push(Problem::new("/near_field/repulsion/exponent", message).hint(hint));
    } else if let Some(distance) = field.inflection()
        && a.strength > 0.0
        && r.strength > 0.0
        && !(1e-100..=1e100).contains(&distance)
    {
        let message = format!("the inflection lies at {distance:e} m, where nothing can be computed");
        problems.push(Problem::new(pointer, message).hint(hint));
    }
}
