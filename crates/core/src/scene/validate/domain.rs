//! Periodic directions and walls: the minimum image must be the only one in reach.

use super::largest_radius;
use crate::scene::{Domain, Problem, Scene};

const AXES: [char; 3] = ['x', 'y', 'z'];

pub(super) fn check(scene: &Scene, problems: &mut Vec<Problem>) {
    let Some(domain) = &scene.domain else { return };
    check_walls(domain, problems);
    let lengths = domain.periodic.unwrap_or_default();
    let Some((axis, length)) =
        (0..3).filter_map(|k| lengths[k].map(|length| (k, length))).min_by(|a, b| a.1.total_cmp(&b.1))
    else {
        return;
    };
    let half = 0.5 * length;
    let limit = format!("half the periodic length along {}, {half} m", AXES[axis]);
    let hint = "shorten it, or make the box longer";
    if let Some(field) = &scene.near_field {
        match field.cutoff_distance() {
            None => problems.push(
                Problem::new("/near_field/cutoff", "a near field in a periodic box needs a cut-off")
                    .hint(format!("add \"cutoff\" of at most {half} m")),
            ),
            Some(cutoff) if cutoff > half => problems.push(
                Problem::new("/near_field/cutoff", format!("the cut-off must be at most {limit}, not {cutoff} m"))
                    .hint(hint),
            ),
            Some(_) => {}
        }
    }
    let Some(diameter) = largest_radius(scene).map(|radius| 2.0 * radius) else { return };
    for (section, range) in
        [("binding", scene.binding.as_ref().map(|b| b.range)), ("clusters", scene.clusters.map(|c| c.range))]
    {
        if let Some(reach) = range.map(|range| range * diameter)
            && reach > half
        {
            let message = format!("the range of the largest particles, {reach} m, must be at most {limit}");
            problems.push(Problem::new(format!("/{section}/range"), message).hint(hint));
        }
    }
    if diameter > half {
        let message = format!("the largest diameter, {diameter} m, must be at most {limit}");
        problems.push(Problem::new(format!("/domain/periodic/{axis}"), message).hint("make the box longer"));
    }
}

fn check_walls(domain: &Domain, problems: &mut Vec<Problem>) {
    let lengths = domain.periodic.unwrap_or_default();
    for (k, wall) in domain.walls.iter().enumerate() {
        let pointer = format!("/domain/walls/{k}/normal");
        let square: f64 = wall.normal.iter().map(|c| c * c).sum();
        if wall.normal == [0.0; 3] {
            problems.push(
                Problem::new(pointer, "the normal of a wall must not be zero")
                    .hint("it points into the side of the particles, such as [0, 0, 1]"),
            );
            continue;
        }
        if !(1e-200..=1e200).contains(&square) {
            problems.push(
                Problem::new(
                    pointer,
                    format!("the length of the normal, {:e}, cannot be computed with", square.sqrt()),
                )
                .hint("write a unit vector"),
            );
            continue;
        }
        if let Some(axis) = (0..3).find(|&axis| wall.normal[axis] != 0.0 && lengths[axis].is_some()) {
            let message = format!("the wall bounds the direction {}, which is periodic", AXES[axis]);
            problems.push(
                Problem::new(pointer, message)
                    .hint(format!("make the direction open with null at /domain/periodic/{axis}, or turn the wall")),
            );
        }
    }
}
