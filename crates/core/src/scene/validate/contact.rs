//! Impact, reaction heat and what they ask of the model.

use crate::scene::{Contact, ContactResolution, ImpactDuration, ModelKind, Problem, Restitution, Scene};

pub(super) fn check(scene: &Scene, problems: &mut Vec<Problem>) {
    let reaction = scene.thermal.as_ref().and_then(|thermal| thermal.reaction);
    match &scene.contact {
        Some(contact) => check_contact(scene, contact, reaction.is_some(), problems),
        None => {
            if reaction.is_some() {
                problems.push(
                    Problem::new(
                        "/thermal/reaction",
                        "reactions are set off by impacts, but the scene has no `contact`",
                    )
                    .hint("add \"contact\", or leave \"reaction\" out"),
                );
            }
            if scene.domain.as_ref().is_some_and(|domain| !domain.walls.is_empty()) {
                problems.push(
                    Problem::new("/domain/walls", "particles fly through walls, since the scene has no `contact`")
                        .hint("add \"contact\", or leave \"walls\" out"),
                );
            }
        }
    }
}

fn check_contact(scene: &Scene, contact: &Contact, reaction: bool, problems: &mut Vec<Problem>) {
    if let Restitution::Law(law) = &contact.restitution {
        if let Some(e_min) = law.e_min
            && e_min > law.e0
        {
            let message = format!("e_min must be at most e0, {}, not {e_min}", law.e0);
            problems.push(Problem::new("/contact/restitution/e_min", message));
        }
        if law.theta_star.is_some() && scene.thermal.is_none() {
            let message = "theta_star asks for temperatures, but the scene has no `thermal`";
            problems.push(
                Problem::new("/contact/restitution/theta_star", message)
                    .hint("add \"thermal\", or leave \"theta_star\" out"),
            );
        }
    }
    if let Some(friction) = contact.friction
        && friction.dynamic > friction.static_
    {
        let message =
            format!("dynamic friction must be at most the static, {}, not {}", friction.static_, friction.dynamic);
        problems.push(Problem::new("/contact/friction/dynamic", message));
    }
    if contact.resolution == Some(ContactResolution::Located) && scene.model == ModelKind::Paper {
        problems.push(
            Problem::new(
                "/contact/resolution",
                "the model `paper` knows no located impacts: contacts act during steps",
            )
            .hint("write \"step\", or choose the model \"consistent\""),
        );
    }
    if contact.rest_speed.is_some() && scene.model == ModelKind::Paper {
        problems.push(
            Problem::new("/contact/rest_speed", "the model `paper` knows no resting contacts")
                .hint("leave \"rest_speed\" out, or choose the model \"consistent\""),
        );
    }
    check_duration(scene, contact, reaction, problems);
}

fn check_duration(scene: &Scene, contact: &Contact, reaction: bool, problems: &mut Vec<Problem>) {
    match (contact.duration, scene.model) {
        (None, _) if reaction => problems.push(
            Problem::new(
                "/contact",
                "a reaction needs the duration of an impact, which turns its impulse into a force",
            )
            .hint("add \"duration\": { \"seconds\": 1e-5 }"),
        ),
        (Some(ImpactDuration::StepFraction(_)), ModelKind::Consistent) if reaction => problems.push(
            Problem::new(
                "/contact/duration/step_fraction",
                "with a duration in steps the reaction heat has no limit as the step goes to zero",
            )
            .hint("give the duration as { \"seconds\": 1e-5 }, or choose the model \"paper\""),
        ),
        (Some(ImpactDuration::Seconds(seconds)), ModelKind::Paper) => {
            let (_, max, _) = scene.solver.step.limits();
            if seconds > max {
                let message =
                    format!("in the model `paper` an impact lasts at most a step, {max:e} s, not {seconds:e} s");
                problems.push(
                    Problem::new("/contact/duration/seconds", message)
                        .hint("shorten it, or raise \"max\" in /solver/step"),
                );
            }
        }
        _ => {}
    }
}
