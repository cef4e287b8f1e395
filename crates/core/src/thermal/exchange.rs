//! Exchange with the surroundings (41): m C theta' = -h_c a_s (theta - theta_0) - B eps a_s (theta^4 - theta_s^4).
//!
//! a_s = 4 pi b^2 [m^2]; theta_0 temperature of the gas, theta_s of the far surroundings [K]; B Stefan-Boltzmann's
//! constant. `paper` takes one backward Euler step, (42). `consistent` uses the exact solution where there is one
//! (convection or radiation alone), else an L-stable scheme of second order with substeps; steps in which a temperature
//! hardly changes take a Taylor series, as exact. theta > 0 always, and theta never passes the temperature it tends to.
//! The heat goes into the ledger as convected and radiated.

use crate::math::Sum;
use crate::scene::{ModelKind, Scene};
use crate::state::Particles;

/// Stefan-Boltzmann's constant (CODATA 2018) [W/(m^2 K^4)].
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;
/// The paper's value [W/(m^2 K^4)].
pub const STEFAN_BOLTZMANN_PAPER: f64 = 5.67e-8;
/// Error allowed to a substep where convection and radiation act together, relative to max(theta, 1 K) [-].
const SUBSTEP_TOLERANCE: f64 = 1e-10;

/// Largest step, in shortest times constant of the law, for a Taylor series: its remainder is then at most a round-off of
/// the change [-].
const SHORT: f64 = 1.0 / 8192.0;

/// Substeps of one step; hundreds are enough for a drop from 1e5 K.
const MAX_SUBSTEPS: usize = 10_000;

/// Which solution applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scheme {
    BackwardEuler,
    Convection,
    Radiation,
    Both,
}

/// Convection and radiation of a scene.
#[derive(Clone, Debug)]
pub struct Exchange {
    scheme: Scheme,
    convects: bool,
    radiates: bool,
    /// theta_0 [K].
    ambient: f64,
    /// theta_s [K].
    surroundings: f64,
    /// h_c a_s / (m C) of every particle, length n [1/s].
    convection: Vec<f64>,
    /// B eps a_s / (m C) of every particle, length n [1/(K^3 s)].
    radiation: Vec<f64>,
    /// m C of every particle, length n [J/K].
    capacity: Vec<f64>,
}

/// Heat given off in a step [J].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exchanged {
    /// By convection.
    pub convected: f64,
    /// By radiation.
    pub radiated: f64,
}

impl Exchange {
    /// From a scene; `None` where nothing is exchanged.
    #[must_use]
    pub fn new(scene: &Scene, particles: &Particles) -> Option<Self> {
        let thermal = scene.thermal.as_ref()?;
        // A zero coefficient is an effect that is absent.
        let convection = thermal.convection.filter(|convection| convection.coefficient > 0.0);
        let radiation = thermal.radiation.filter(|radiation| radiation.emissivity > 0.0);
        let scheme = match (scene.model, convection, radiation) {
            (_, None, None) => return None,
            (ModelKind::Paper, ..) => Scheme::BackwardEuler,
            (ModelKind::Consistent, Some(_), None) => Scheme::Convection,
            (ModelKind::Consistent, None, Some(_)) => Scheme::Radiation,
            (ModelKind::Consistent, Some(_), Some(_)) => Scheme::Both,
        };
        let constant = match scene.model {
            ModelKind::Paper => STEFAN_BOLTZMANN_PAPER,
            ModelKind::Consistent => STEFAN_BOLTZMANN,
        };
        let capacity: Vec<f64> = particles.mass.iter().map(|m| m * thermal.heat_capacity).collect();
        let rate = |factor: f64| -> Vec<f64> {
            let area = |b: f64| 4.0 * std::f64::consts::PI * b * b;
            particles.radius.iter().zip(&capacity).map(|(&b, mc)| factor * area(b) / mc).collect()
        };
        Some(Self {
            scheme,
            convects: convection.is_some(),
            radiates: radiation.is_some(),
            ambient: convection.map_or(0.0, |convection| convection.ambient),
            surroundings: radiation.map_or(0.0, |radiation| radiation.surroundings),
            convection: rate(convection.map_or(0.0, |convection| convection.coefficient)),
            radiation: rate(radiation.map_or(0.0, |radiation| constant * radiation.emissivity)),
            capacity,
        })
    }

    /// Takes `theta` [K], length n, over a time dt [s].
    pub fn advance(&self, dt: f64, theta: &mut [f64]) {
        for (i, theta) in theta.iter_mut().enumerate() {
            *theta = self.particle(i).advance(self.scheme, dt, *theta).0;
        }
    }

    /// As [`Exchange::advance`], and says what was given off.
    pub fn advance_and_book(&self, dt: f64, theta: &mut [f64]) -> Exchanged {
        let (mut convected, mut radiated) = (Sum::default(), Sum::default());
        for (i, theta) in theta.iter_mut().enumerate() {
            let exchanged = self.advance_one(i, dt, theta);
            convected.add(exchanged.convected);
            radiated.add(exchanged.radiated);
        }
        Exchanged { convected: convected.value(), radiated: radiated.value() }
    }

    /// As [`Exchange::advance_and_book`], for all particles but some.
    pub fn advance_others(&self, dt: f64, theta: &mut [f64], skip: impl Fn(usize) -> bool) -> Exchanged {
        let (mut convected, mut radiated) = (Sum::default(), Sum::default());
        for (i, theta) in theta.iter_mut().enumerate().filter(|(i, _)| !skip(*i)) {
            let exchanged = self.advance_one(i, dt, theta);
            convected.add(exchanged.convected);
            radiated.add(exchanged.radiated);
        }
        Exchanged { convected: convected.value(), radiated: radiated.value() }
    }

    /// Takes the temperature of particle i [K] over a time dt [s], and says what it gave off.
    pub fn advance_one(&self, i: usize, dt: f64, theta: &mut f64) -> Exchanged {
        let before = *theta;
        let (after, by_convection) = self.particle(i).advance(self.scheme, dt, before);
        *theta = after;
        let drop = before - after;
        // Where one of the two is absent the other is all, and nothing is left to round-off.
        let by_convection = match (self.convects, self.radiates) {
            (true, false) => drop,
            (false, _) => 0.0,
            (true, true) => by_convection,
        };
        Exchanged { convected: self.capacity[i] * by_convection, radiated: self.capacity[i] * (drop - by_convection) }
    }

    fn particle(&self, i: usize) -> Particle {
        Particle {
            convection: self.convection[i],
            radiation: self.radiation[i],
            ambient: self.ambient,
            surroundings: self.surroundings,
        }
    }
}

/// One particle's cooling law, per heat capacity.
#[derive(Clone, Copy, Debug)]
struct Particle {
    convection: f64,
    radiation: f64,
    ambient: f64,
    surroundings: f64,
}

impl Particle {
    /// Temperature after dt, and the part of the drop that is due to convection [K].
    fn advance(&self, scheme: Scheme, dt: f64, theta: f64) -> (f64, f64) {
        if theta.is_nan() {
            return (theta, 0.0);
        }
        let hottest = theta.max(self.ambient).max(self.surroundings);
        let stiffness = self.convection + 4.0 * self.radiation * hottest * hottest * hottest;
        match scheme {
            Scheme::Convection | Scheme::Radiation | Scheme::Both if stiffness * dt <= SHORT => self.short(dt, theta),
            Scheme::BackwardEuler => {
                let after = self.implicit(dt, theta);
                (after, dt * self.convection * (after - self.ambient))
            }
            Scheme::Convection => {
                let drop = (self.ambient - theta) * libm::expm1(-self.convection * dt);
                (theta - drop, drop)
            }
            Scheme::Radiation => (self.radiate(dt, theta), 0.0),
            Scheme::Both => self.substeps(dt, theta),
        }
    }

    /// Rate of cooling [K/s].
    fn rate(&self, theta: f64) -> f64 {
        self.convection * (theta - self.ambient) + self.radiation * (fourth(theta) - fourth(self.surroundings))
    }

    /// Four terms of the Taylor series. All of them have the sign of the first, or are far smaller: cooling stays cooling.
    ///
    /// With f = theta' and its derivatives by theta the terms are f dt, f f' dt^2/2, f (f'^2 + f f'') dt^3/6 and
    /// f (f'^3 + 4 f f' f'' + f^2 f''') dt^4/24; with p = stiffness dt the fifth is below p^4 of the first.
    fn short(&self, dt: f64, theta: f64) -> (f64, f64) {
        let (squares, sum) = (theta * theta + self.surroundings * self.surroundings, theta + self.surroundings);
        let difference = theta - self.ambient;
        let f = -self.convection * difference - self.radiation * ((theta - self.surroundings) * sum * squares);
        let curve = -12.0 * self.radiation * theta;
        let f1 = (-self.convection + curve * theta * theta / 3.0) * dt;
        let (f2, f3) = (f * curve * theta * dt * dt, 2.0 * f * f * curve * dt * dt * dt);
        let [second, third, fourth] = [f1 / 2.0, (f1 * f1 + f2) / 6.0, (f1 * f1 * f1 + 4.0 * f1 * f2 + f3) / 24.0];
        let change = f * dt * (1.0 + (second + (third + fourth)));
        // The integral of theta - theta_0 over the step.
        let mean = difference + f * dt * (0.5 + (second / 3.0 + (third / 4.0 + fourth / 5.0)));
        (theta + change, self.convection * dt * mean)
    }

    /// Solves x + h * rate(x) = c, the implicit step (42); one positive root, found from above.
    ///
    /// The left side is convex and grows for x > 0, so Newton's method falls towards the root without passing it.
    fn implicit(&self, h: f64, c: f64) -> f64 {
        let (linear, quartic) = (1.0 + h * self.convection, h * self.radiation);
        let right = c + h * (self.convection * self.ambient + self.radiation * fourth(self.surroundings));
        let mut x = right / linear;
        if quartic > 0.0 {
            x = x.min((right / quartic).sqrt().sqrt());
        }
        for _ in 0..100 {
            let cube = quartic * x * x * x;
            let next = x - (x * (linear + cube) - right) / (linear + 4.0 * cube);
            if next >= x || next.is_nan() {
                break;
            }
            x = next;
        }
        x
    }

    /// Radiation alone, exactly.
    ///
    /// With x = theta/theta_s and tau = rate theta_s^3 dt the solution obeys G(x') = G(x) - 4 tau,
    /// G = ln|(x - 1)/(x + 1)| - 2 atan x. Solved for z = ln((x' - 1)/(x - 1)) <= 0, in which the equation is monotone
    /// and its Newton iterates stay on one side of the root after the first.
    fn radiate(&self, dt: f64, theta: f64) -> f64 {
        let theta_s = self.surroundings;
        if theta_s == 0.0 {
            return theta / libm::cbrt(1.0 + 3.0 * self.radiation * theta * theta * theta * dt);
        }
        let (x, tau) = (theta / theta_s, self.radiation * theta_s * theta_s * theta_s * dt);
        let excess = x - 1.0;
        if excess == 0.0 {
            return theta;
        }
        let mut z = 0.0;
        for _ in 0..100 {
            // change = x' - x, without cancellation for short steps
            let change = excess * libm::expm1(z);
            let end = x + change;
            let f = z - libm::log1p(change / (x + 1.0)) - 2.0 * libm::atan(change / (1.0 + x * end)) + 4.0 * tau;
            let slope = 4.0 / ((end + 1.0) * (end * end + 1.0));
            let next = (z - f / slope).min(0.0);
            let done = (next - z).abs() <= 1e-15 * next.abs();
            z = next;
            if done {
                break;
            }
        }
        theta + theta_s * (excess * libm::expm1(z))
    }

    /// Convection and radiation together: Alexander's two-stage scheme (L-stable, order 2), substeps by step doubling.
    fn substeps(&self, dt: f64, theta: f64) -> (f64, f64) {
        let (mut at, mut convected, mut left, mut h) = (theta, 0.0, dt, dt);
        for _ in 0..MAX_SUBSTEPS {
            h = h.min(left);
            let (whole, once) = self.alexander(h, at);
            let (half, first) = self.alexander(0.5 * h, at);
            let (end, second) = self.alexander(0.5 * h, half);
            // The halves are four times as good: their error is a third of the difference, and is taken off.
            let correction = (end - whole) / 3.0;
            let error = correction.abs() / (SUBSTEP_TOLERANCE * at.max(1.0));
            let (end, drop) = (end + correction, first + second + (first + second - once) / 3.0);
            // At equilibrium round-off must not turn cooling into heating.
            let end = if self.rate(at) > 0.0 { end.min(at) } else { end.max(at) };
            // Neither may pass the equilibrium that both tend to: cooling must not turn into heating.
            let monotone = end > 0.0 && self.rate(at) * self.rate(end) >= 0.0;
            if (error <= 1.0 && monotone) || h <= 1e-12 * dt {
                at = end;
                convected += drop;
                left -= h;
            }
            if left <= 0.0 {
                return (at, convected);
            }
            let factor = if monotone && error > 0.0 { 0.9 / libm::cbrt(error) } else { 0.25 };
            h *= if monotone && error == 0.0 { 4.0 } else { factor.clamp(0.1, 4.0) };
        }
        // Heat beyond any scale of the step: one damped step for what is left.
        let end = self.implicit(left, at);
        (end, convected + left * self.convection * (end - self.ambient))
    }

    /// One step of Alexander's scheme, and the drop by convection in it [K].
    fn alexander(&self, h: f64, theta: f64) -> (f64, f64) {
        const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
        let first = self.implicit(GAMMA * h, theta);
        let start = theta - (1.0 - GAMMA) * h * self.rate(first);
        if start <= 0.0 {
            // Too long a step for this scheme; the caller sees a value that is not monotone.
            return (0.0, 0.0);
        }
        let end = self.implicit(GAMMA * h, start);
        let drop = |x: f64| self.convection * (x - self.ambient);
        (end, h * ((1.0 - GAMMA) * drop(first) + GAMMA * drop(end)))
    }
}

fn fourth(x: f64) -> f64 {
    (x * x) * (x * x)
}

#[cfg(test)]
mod tests {
    use super::{Particle, SHORT, Scheme};

    fn particle(convection: f64, radiation: f64) -> Particle {
        Particle { convection, radiation, ambient: 250.0, surroundings: 300.0 }
    }

    /// Fourth-order Runge-Kutta with many small steps.
    fn reference(p: &Particle, dt: f64, theta: f64) -> f64 {
        let n = 20_000;
        let h = dt / f64::from(n);
        (0..n).fold(theta, |x, _| {
            let k1 = -p.rate(x);
            let k2 = -p.rate(x + 0.5 * h * k1);
            let k3 = -p.rate(x + 0.5 * h * k2);
            let k4 = -p.rate(x + h * k3);
            x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        })
    }

    #[test]
    fn closed_forms_agree_with_a_converged_reference() {
        for theta in [1.0, 299.0, 301.0, 1000.0, 3000.0] {
            for dt in [1e-6, 1e-2, 1.0, 30.0] {
                let p = particle(0.0, 1e-10);
                let (ours, truth) = (p.advance(Scheme::Radiation, dt, theta).0, reference(&p, dt, theta));
                assert!((ours - truth).abs() <= 1e-11 * truth, "{theta} {dt}: {ours} {truth}");
                let p = particle(0.3, 0.0);
                let (ours, truth) = (p.advance(Scheme::Convection, dt, theta).0, reference(&p, dt, theta));
                assert!((ours - truth).abs() <= 1e-11 * truth, "{theta} {dt}: {ours} {truth}");
                let p = particle(0.3, 1e-10);
                let (ours, truth) = (p.advance(Scheme::Both, dt, theta).0, reference(&p, dt, theta));
                // Substeps are held to 1e-10 each; fewer than a hundred are taken.
                assert!((ours - truth).abs() <= 1e-8 * truth, "{theta} {dt}: {ours} {truth}");
            }
        }
    }

    /// Where the series ends the other schemes begin: both sides agree to the error of the less exact one.
    #[test]
    fn series_go_over_into_the_schemes_for_longer_steps() {
        for (scheme, convection, radiation, allowed) in [
            (Scheme::Convection, 0.3, 0.0, 1e-14),
            (Scheme::Radiation, 0.0, 1e-10, 1e-14),
            // Held to 1e-10 of the temperature, and the step's drop is 1e-4 of it.
            (Scheme::Both, 0.3, 1e-10, 1e-10),
        ] {
            let p = particle(convection, radiation);
            for theta in [1.0, 249.0, 299.99, 300.01, 1000.0, 3000.0_f64] {
                let hottest = theta.max(300.0);
                let dt = SHORT / (convection + 4.0 * radiation * hottest.powi(3));
                let (short, drop) = p.short(dt, theta);
                let (long, long_drop) = match scheme {
                    Scheme::Convection => {
                        let drop = (250.0 - theta) * libm::expm1(-convection * dt);
                        (theta - drop, drop)
                    }
                    Scheme::Radiation => (p.radiate(dt, theta), 0.0),
                    _ => p.substeps(dt, theta),
                };
                // Both are rounded once to a temperature.
                let rounded = f64::EPSILON * theta;
                let scale = allowed * if scheme == Scheme::Both { theta } else { (theta - long).abs() };
                assert!((short - long).abs() <= scale + rounded, "{scheme:?} {theta}: {short} {long}");
                assert!((drop - long_drop).abs() <= scale + rounded, "{scheme:?} {theta}: {drop} {long_drop}");
            }
        }
    }

    /// Reading and writing heat over many short steps adds up to that of one long step.
    #[test]
    fn many_short_steps_are_one_long_step() {
        let p = particle(0.3, 1e-10);
        let (mut theta, mut convected) = (1000.0, 0.0);
        for _ in 0..100_000 {
            let (next, drop) = p.advance(Scheme::Both, 1e-5, theta);
            (theta, convected) = (next, convected + drop);
        }
        let (end, drop) = p.advance(Scheme::Both, 1.0, 1000.0);
        // Each of the substeps is held to 1e-10, fewer than a hundred are taken; round-off of 1e5 sums is smaller.
        assert!((theta - end).abs() <= 1e-8 * end, "{theta} {end}");
        assert!((convected - drop).abs() <= 1e-8 * end, "{convected} {drop}");
    }

    /// A sphere of 1 um at 3000 K loses its heat within microseconds; no step may overshoot.
    #[test]
    fn small_hot_particles_cool_monotonically() {
        for scheme in [Scheme::BackwardEuler, Scheme::Radiation, Scheme::Both] {
            let p = particle(if scheme == Scheme::Both { 1e3 } else { 0.0 }, 8.5e-8);
            let mut theta = 3000.0;
            for _ in 0..1000 {
                let next = p.advance(scheme, 1e-2, theta).0;
                assert!(next > 0.0 && next <= theta, "{scheme:?}: {theta} -> {next}");
                theta = next;
            }
        }
    }

    #[test]
    fn at_rest_with_the_surroundings_nothing_changes() {
        let p = Particle { convection: 0.0, radiation: 1e-9, ambient: 300.0, surroundings: 300.0 };
        assert_eq!(p.advance(Scheme::Radiation, 1.0, 300.0).0, 300.0);
    }
}
