//! The layout for Foxglove and Lichtblick that fits a scene: panels of the effects it has, colours on its scale, the camera
//! on its particles.

use agglo_core::scene::{ListedParticle, ParticleSource, Scene};
use agglo_core::state::{Particles, State};
use serde_json::{Value, json};

use crate::channels::Effects;
use crate::palette;

/// The layout with every panel, which also opens any log by hand.
pub const FULL: &str = include_str!("../viewer/layout.json");

/// The layout for a scene whose particles are known; [`FULL`] where they are not.
#[must_use]
pub fn layout(scene: &Scene) -> String {
    // The full layout is a constant that a test parses.
    let (Ok(mut layout), Ok(effects)) = (serde_json::from_str(FULL), Effects::of(scene)) else {
        return FULL.to_owned();
    };
    let view = View::new(scene);
    keep_panels(&mut layout, &effects);
    keep_series(&mut layout, scene);
    color(&mut layout, &effects, &view);
    aim(&mut layout, &view);
    format!("{layout:#}\n")
}

/// The variant without the panels of effects that the scene does not have.
fn keep_panels(layout: &mut Value, effects: &Effects) {
    let kept = |panel: &str| match panel {
        "3D!spheres" => effects.markers,
        "Plot!temperature" => effects.thermal,
        "Plot!clusters" => effects.clusters,
        "Table!impacts" => effects.contact,
        _ => true,
    };
    if let Some(panels) = layout["configById"].as_object_mut() {
        panels.retain(|panel, _| kept(panel));
    }
    layout["layout"] = pruned(layout["layout"].take(), &kept).unwrap_or_default();
}

/// A tree of panels without those that are not kept; who stood beside one takes its place.
fn pruned(tree: Value, kept: &impl Fn(&str) -> bool) -> Option<Value> {
    let Value::Object(mut split) = tree else {
        return tree.as_str().is_some_and(kept).then_some(tree);
    };
    let mut part = |name: &str| split.get_mut(name).map(Value::take).and_then(|part| pruned(part, kept));
    match (part("first"), part("second")) {
        (Some(first), Some(second)) => {
            split.insert("first".to_owned(), first);
            split.insert("second".to_owned(), second);
            Some(Value::Object(split))
        }
        (one, other) => one.or(other),
    }
}

/// Leaves out curves of energies that stay zero.
fn keep_series(layout: &mut Value, scene: &Scene) {
    let contact = scene.contact.as_ref();
    let kept = |path: &str| match path {
        "/energy.near_field" => scene.near_field.is_some(),
        "/energy.binding" => scene.binding.is_some(),
        "/energy.external" => scene.external.is_some(),
        "/energy.impact_loss" => contact.is_some(),
        "/energy.friction_loss" => contact.is_some_and(|contact| contact.friction.is_some()),
        _ => true,
    };
    for (_, panel) in layout["configById"].as_object_mut().into_iter().flatten() {
        if let Some(paths) = panel.get_mut("paths").and_then(Value::as_array_mut) {
            paths.retain(|path| path["value"].as_str().is_some_and(kept));
        }
    }
}

/// Colours the particles, and says in the titles what the colours mean.
fn color(layout: &mut Value, effects: &Effects, view: &View) {
    let panels = &mut layout["configById"];
    let shown = match view.temperatures {
        Some((low, high)) => format!("temperature, {} K blue to {} K red", round(low), round(high)),
        None if effects.charge => "charge, negative blue to positive red".to_owned(),
        None => "speed, at rest blue to fastest red".to_owned(),
    };
    if effects.markers {
        name(&mut panels["3D!spheres"], &format!("Particles, true sizes: {shown}"));
    }
    let cloud = &mut panels["3D!points"]["topics"]["/particles"];
    let mut map = |field: &str, low: f64, high: f64| {
        cloud["colorField"] = field.into();
        (cloud["minValue"], cloud["maxValue"]) = (json!(low), json!(high));
    };
    let title = match view.temperatures {
        Some((low, high)) => {
            map("temperature", low, high);
            format!("States: temperature, {} to {} K", round(low), round(high))
        }
        // Charges and speeds are no columns; they are in the bytes red, green, blue, alpha.
        None if effects.markers => {
            if let Some(cloud) = cloud.as_object_mut() {
                ["colorField", "minValue", "maxValue"].iter().for_each(|key| drop(cloud.remove(*key)));
                cloud.insert("colorMode".to_owned(), "rgba-fields".into());
            }
            format!("States: {shown}")
        }
        None => {
            map("vx", -view.speed, view.speed);
            format!("States: velocity along x, {} to {} m/s", round(-view.speed), round(view.speed))
        }
    };
    if effects.particles > 1000 {
        panels["3D!points"]["topics"]["/particles"]["pointSize"] =
            json!(if effects.particles > 100_000 { 2 } else { 4 });
    }
    name(&mut panels["3D!points"], &title);
}

/// Gives a panel its title, for either viewer.
fn name(panel: &mut Value, title: &str) {
    for key in ["foxglovePanelTitle", "lichtblickPanelTitle"] {
        panel[key] = title.into();
    }
}

/// Points the cameras at the particles, and lays the grid below them.
fn aim(layout: &mut Value, view: &View) {
    let size = view.diagonal();
    let middle: [f64; 3] = std::array::from_fn(|axis| 0.5 * (view.low[axis] + view.high[axis]));
    for panel in ["3D!spheres", "3D!points"] {
        let Some(panel) = layout["configById"].get_mut(panel) else { continue };
        let camera = &mut panel["cameraState"];
        camera["distance"] = json!(size);
        (camera["near"], camera["far"]) = (json!(1e-3 * size), json!(1e3 * size));
        camera["target"] = json!(middle);
        camera["targetOffset"] = json!(middle);
        let grid = &mut panel["layers"]["grid"];
        grid["size"] = json!(2.0 * size);
        grid["position"] = json!([middle[0], middle[1], view.low[2]]);
    }
}

/// What of a scene decides how it is looked at.
struct View {
    /// Corners of the box around the particles at the start, and where nothing stops them around where they drift [m].
    low: [f64; 3],
    high: [f64; 3],
    /// Ends of the colour scale [K].
    temperatures: Option<(f64, f64)>,
    /// Largest velocity along x that the scene names [m/s].
    speed: f64,
}

impl View {
    fn new(scene: &Scene) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let (mut speed, mut drift) = (0.0_f64, [0.0; 3]);
        let mut particles = Particles::default();
        let mut start = State::default();
        match &scene.particles {
            ParticleSource::RandomCube(cube) => {
                let radius = cube.radius_of_each().unwrap_or(0.0);
                (low, high) = ([-radius; 3], [cube.side + radius; 3]);
                (speed, drift) = (cube.velocity_mean[0].abs() + cube.velocity_spread[0], cube.velocity_mean);
                // One of them: they are all equal.
                (particles.radius, particles.mass) = (vec![radius], vec![sphere(cube.density, radius)]);
                start.temperature = cube.temperature.map(|theta| vec![theta]);
            }
            ParticleSource::List(list) => {
                for ListedParticle { position, velocity, radius, .. } in list {
                    for axis in 0..3 {
                        low[axis] = low[axis].min(position[axis] - radius);
                        high[axis] = high[axis].max(position[axis] + radius);
                        drift[axis] += velocity[axis] / list.len() as f64;
                    }
                    speed = speed.max(velocity[0].abs());
                }
                if let [first, ..] = &list[..] {
                    let mass = first.mass.unwrap_or_else(|| sphere(first.density.unwrap_or(0.0), first.radius));
                    (particles.radius, particles.mass) = (vec![first.radius], vec![mass]);
                }
                start.temperature = list.iter().map(|particle| particle.temperature).collect();
            }
            ParticleSource::File(_) | ParticleSource::Log(_) => {}
        }
        let walls = scene.domain.as_ref().is_some_and(|domain| !domain.walls.is_empty());
        for axis in 0..3 {
            let period = scene.domain.as_ref().and_then(|domain| domain.periodic?[axis]);
            if let Some(period) = period {
                (low[axis], high[axis]) = (0.0, period);
            } else if !walls {
                let way = drift[axis] * scene.duration;
                (low[axis], high[axis]) = (low[axis] + way.min(0.0), high[axis] + way.max(0.0));
            }
        }
        let temperatures = palette::temperatures(scene, &particles, &start);
        Self { low, high, temperatures, speed: if speed > 0.0 { speed } else { 1.0 } }
    }

    /// The diagonal of the box [m].
    fn diagonal(&self) -> f64 {
        let square: f64 = (0..3).map(|axis| self.high[axis] - self.low[axis]).map(|edge| edge * edge).sum();
        if square.is_finite() && square > 0.0 { square.sqrt() } else { 1.0 }
    }
}

/// Mass of a sphere [kg].
fn sphere(density: f64, radius: f64) -> f64 {
    density * (4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius)
}

/// A number for people, in four digits.
fn round(value: f64) -> String {
    if !(1e-3..1e5).contains(&value.abs()) && value != 0.0 {
        return format!("{value:.3e}");
    }
    // Powers of ten by comparison: a logarithm may be another one on another platform.
    let digits = [1e3, 1e2, 1e1, 1e0, 1e-1, 1e-2].iter().position(|power| value.abs() >= *power).unwrap_or(6);
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
