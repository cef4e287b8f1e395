//! Colours of particles: by temperature where there is one, else by charge, else by speed.

use agglo_core::scene::{Restitution, Scene};
use agglo_core::state::{Particles, State};

/// Blue, light blue, grey, orange, red: the order of the values can be seen without a legend, and zero charge is grey.
const STOPS: [[f64; 3]; 5] =
    [[0.23, 0.30, 0.75], [0.48, 0.68, 0.95], [0.80, 0.80, 0.80], [0.93, 0.52, 0.40], [0.71, 0.02, 0.15]];

/// What the colours stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// Temperature from the coldest that the scene names [K] to a hottest that it suggests.
    Temperature { low: f64, high: f64 },
    /// Charge from minus to plus the largest.
    Charge,
    /// Speed over the largest seen so far [m/s].
    Speed { largest: f64 },
}

/// Makes colours of states.
#[derive(Clone, Debug)]
pub struct Palette {
    scale: Scale,
    table: Vec<[u8; 4]>,
    colors: Vec<[u8; 4]>,
}

impl Palette {
    /// The colours of a run of a scene that starts from this state.
    pub fn new(scene: &Scene, particles: &Particles, start: &State) -> Self {
        let scale = match temperatures(scene, particles, start) {
            Some((low, high)) => Scale::Temperature { low, high },
            None if particles.charge.is_some() => Scale::Charge,
            None => Scale::Speed { largest: 0.0 },
        };
        Self { scale, table: (0..=255).map(|k| ramp(f64::from(k) / 255.0)).collect(), colors: Vec::new() }
    }

    /// The colours of the particles in this state: red, green, blue, alpha.
    pub fn colors(&mut self, particles: &Particles, state: &State) -> &[[u8; 4]] {
        let n = particles.len();
        self.colors.clear();
        let table = &self.table;
        let color = |share: f64| table[(share.clamp(0.0, 1.0) * 255.0).round() as usize];
        match (&mut self.scale, &state.temperature, &particles.charge) {
            (Scale::Temperature { low, high }, Some(temperature), _) => {
                self.colors.extend(temperature.iter().map(|theta| color((theta - *low) / (*high - *low))));
            }
            (Scale::Charge, _, Some(charge)) => {
                let largest = charge.iter().fold(0.0_f64, |largest, q| largest.max(q.abs()));
                let half = if largest > 0.0 { 0.5 / largest } else { 0.0 };
                self.colors.extend(charge.iter().map(|q| color(0.5 + q * half)));
            }
            (Scale::Speed { largest }, _, _) => {
                let speed = |k| state.velocity.get(k).norm();
                *largest = (0..n).map(speed).fold(*largest, f64::max);
                let over = if *largest > 0.0 { 1.0 / *largest } else { 0.0 };
                self.colors.extend((0..n).map(|k| color(speed(k) * over)));
            }
            _ => self.colors.resize(n, color(0.5)),
        }
        &self.colors
    }

    /// The colours of the state before.
    pub fn last(&self) -> &[[u8; 4]] {
        &self.colors
    }
}

/// The colour at a share of the way from the first stop to the last.
fn ramp(share: f64) -> [u8; 4] {
    let place = share * (STOPS.len() - 1) as f64;
    let k = (place as usize).min(STOPS.len() - 2);
    let rest = place - k as f64;
    let channel = |c: usize| ((STOPS[k][c] + (STOPS[k + 1][c] - STOPS[k][c]) * rest) * 255.0).round() as u8;
    [channel(0), channel(1), channel(2), 255]
}

/// The range of temperatures that a scene suggests [K]: from the coldest to the hottest of the start and the
/// surroundings, and where there is a reaction up to twenty complete ones of the first particle, but not beyond the
/// temperature where restitution vanishes. `None` without temperatures.
#[must_use]
pub fn temperatures(scene: &Scene, particles: &Particles, start: &State) -> Option<(f64, f64)> {
    const REACTIONS: f64 = 20.0;
    let thermal = scene.thermal.as_ref()?;
    let mut named = start.temperature.clone()?;
    named.extend(thermal.radiation.map(|radiation| radiation.surroundings));
    named.extend(thermal.convection.map(|convection| convection.ambient));
    let low = named.iter().copied().fold(f64::INFINITY, f64::min);
    let mut high = named.iter().copied().fold(low, f64::max);
    if let (Some(reaction), [radius, ..], [mass, ..]) = (thermal.reaction, &particles.radius[..], &particles.mass[..]) {
        let warming =
            reaction.energy_per_area * std::f64::consts::PI * radius * radius / (mass * thermal.heat_capacity);
        let vanishing = match scene.contact.as_ref().map(|contact| contact.restitution) {
            Some(Restitution::Law(law)) => law.theta_star,
            Some(Restitution::Constant(_)) | None => None,
        };
        high = high.max((low + REACTIONS * warming).min(vanishing.unwrap_or(f64::INFINITY)));
    }
    // One temperature only: what is a kelvin warmer is red.
    Some(if high > low && high.is_finite() { (low, high) } else { (low, low + 1.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_starts_blue_and_ends_red() {
        let [r, _, b, a] = ramp(0.0);
        assert!(b > r && a == 255);
        let [r, _, b, _] = ramp(1.0);
        assert!(r > b);
        let [r, g, b, _] = ramp(0.5);
        assert!(r == g && g == b, "zero charge is grey");
    }

    #[test]
    fn charges_of_either_sign_lie_on_either_side_of_grey() {
        let particles = Particles { radius: vec![1.0; 3], mass: vec![1.0; 3], charge: Some(vec![-2e-6, 0.0, 1e-6]) };
        let state = State::default();
        let scene =
            r#"{"duration": 1.0, "particles": {"list": [{"position": [0, 0, 0], "radius": 1.0, "mass": 1.0}]}}"#;
        let scene = Scene::parse(scene, &[]).expect("a scene");
        let mut palette = Palette::new(&scene, &particles, &state);
        let colors = palette.colors(&particles, &state);
        assert_eq!(colors[0], ramp(0.0));
        assert!(colors[1][0].abs_diff(colors[1][2]) < 8, "grey to a step of the table: {:?}", colors[1]);
        assert!(colors[2][0] > colors[2][2]);
    }
}
