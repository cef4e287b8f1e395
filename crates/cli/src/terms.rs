//! The effects that a scene switches on, a line each.

use agglo_core::Scene;
use agglo_core::scene::{Cutoff, ImpactDuration, NamedCutoff, Restitution, Weight};

use crate::commands::check::word;
use crate::numbers::short;

/// Name and description of every effect of the scene; what it does not have is not mentioned.
#[must_use]
pub fn terms(scene: &Scene) -> Vec<(&'static str, String)> {
    let mut terms = Vec::new();
    if let Some(field) = &scene.near_field {
        let mut parts = Vec::new();
        for (name, term) in [("attraction", &field.attraction), ("repulsion", &field.repulsion)] {
            if let Some(term) = term {
                parts.push(power(name, term.strength, term.exponent, term.weight.unwrap_or(field.weight)));
            }
        }
        parts.push(match field.cutoff {
            Cutoff::Named(NamedCutoff::None) => "no cut-off".to_owned(),
            Cutoff::Named(NamedCutoff::Inflection) => "cut-off at d*".to_owned(),
            Cutoff::Distance(distance) => format!("cut-off at {} m", short(distance)),
        });
        parts.extend(field.switch_from.map(|from| format!("switched off from {} m", short(from))));
        terms.push(("near field", parts.join(", ")));
    }
    if let Some(binding) = &scene.binding {
        let weight = binding.weight.or(scene.near_field.as_ref().map(|field| field.weight)).unwrap_or_default();
        let law = power("attraction", binding.strength, binding.exponent, weight);
        terms.push(("binding", format!("{law}, up to {} (b_i + b_j)", short(binding.range))));
    }
    if let Some(contact) = &scene.contact {
        let mut parts = vec![match &contact.restitution {
            Restitution::Constant(e) => format!("restitution {}", short(*e)),
            Restitution::Law(law) => {
                let mut text = format!("restitution {}", short(law.e0));
                if let Some(v) = law.v_star {
                    text += &format!(", falling with approach speed towards {} m/s", short(v));
                }
                if let Some(theta) = law.theta_star {
                    text += &format!(", none above {} K", short(theta));
                }
                text
            }
        }];
        parts.extend(contact.friction.map(|f| format!("friction {}/{}", short(f.static_), short(f.dynamic))));
        parts.extend(contact.duration.map(|duration| match duration {
            ImpactDuration::StepFraction(share) => format!("lasting {} of a step", short(share)),
            ImpactDuration::Seconds(seconds) => format!("lasting {} s", short(seconds)),
        }));
        terms.push(("impact", parts.join(", ")));
    }
    if let Some(thermal) = &scene.thermal {
        let mut parts = vec![format!("heat capacity {} J/(kg K)", short(thermal.heat_capacity))];
        parts.extend(
            thermal
                .radiation
                .map(|r| format!("radiation to {} K (emissivity {})", short(r.surroundings), short(r.emissivity))),
        );
        parts.extend(
            thermal
                .convection
                .map(|c| format!("convection to {} K ({} W/(m^2 K))", short(c.ambient), short(c.coefficient))),
        );
        parts.extend(
            thermal.reaction.map(|r| {
                format!("reaction {} J/m^2, complete at {} N", short(r.energy_per_area), short(r.force_scale))
            }),
        );
        terms.push(("heat", parts.join(", ")));
    }
    if let Some(clusters) = scene.clusters {
        terms.push(("clusters", format!("pairs within {} (b_i + b_j)", short(clusters.range))));
    }
    if let Some(external) = &scene.external {
        let vector = |v: [f64; 3]| format!("({}, {}, {})", short(v[0]), short(v[1]), short(v[2]));
        let gravity = external.gravity.map(|g| format!("gravity {} m/s^2", vector(g)));
        let field = external.electric_field.map(|e| format!("electric field {} V/m", vector(e)));
        terms.push(("external", gravity.into_iter().chain(field).collect::<Vec<_>>().join(", ")));
    }
    if let Some(domain) = &scene.domain {
        let mut parts = Vec::new();
        if let Some(lengths) = domain.periodic {
            let length = |l: Option<f64>| l.map_or("open".to_owned(), short);
            parts.push(format!(
                "periodic box {} x {} x {} m",
                length(lengths[0]),
                length(lengths[1]),
                length(lengths[2])
            ));
        }
        if !domain.walls.is_empty() {
            parts.push(crate::numbers::counted(domain.walls.len() as u64, "wall"));
        }
        terms.push(("domain", parts.join(", ")));
    }
    terms
}

fn power(name: &str, strength: f64, exponent: f64, weight: Weight) -> String {
    let weighted = if weight == Weight::None { String::new() } else { format!(" x {}", word(&weight)) };
    format!("{name} {} s^-{}{weighted}", short(strength), short(exponent))
}
