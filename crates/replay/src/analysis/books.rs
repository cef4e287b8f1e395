//! What accumulates in the ledger, summed up from impacts, temperatures and times.

use agglo_core::impact::{Impact, Partner};
use agglo_core::ledger::{Ledger, Totals};
use agglo_core::scene::{ModelKind, Scene};
use agglo_core::state::Particles;
use agglo_core::thermal::exchange::{STEFAN_BOLTZMANN, STEFAN_BOLTZMANN_PAPER};

use super::state::{DOUBLE, Rounded, SINGLE, StateValues};

/// Which ways of giving off heat a scene has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ways {
    /// Neither.
    None,
    /// Convection alone: all that is given off.
    Convection,
    /// Radiation alone.
    Radiation,
    /// Both: what is given off is known, how it splits is not.
    Both,
}

/// Sums of what impacts release and take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Impacts {
    /// Impacts.
    pub count: u64,
    /// Reaction heat [J].
    pub reaction_heat: Rounded<f64>,
    /// Loss in normal directions [J].
    pub impact_loss: Rounded<f64>,
    /// Loss to friction [J].
    pub friction_loss: Rounded<f64>,
}

impl Impacts {
    /// Adds an impact, as the ledger books it: one after another, the heat of a wall's partner once.
    fn add(&mut self, impact: &Impact) {
        let hit = if matches!(impact.partner, Partner::Particle(_)) { 2.0 } else { 1.0 };
        let terms = [
            (&mut self.reaction_heat, hit * impact.heat),
            (&mut self.impact_loss, impact.normal_loss()),
            (&mut self.friction_loss, impact.friction_loss()),
        ];
        for (sum, term) in terms {
            sum.value += term;
            sum.tolerance += DOUBLE * term.abs();
        }
        self.count += 1;
    }
}

/// Heat given off since the start [J].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GivenOff {
    /// By convection.
    pub convected: Rounded<f64>,
    /// By radiation.
    pub radiated: Rounded<f64>,
    /// By both, from the balance of thermal energy.
    pub all: Rounded<f64>,
}

/// Where the balance of thermal energy begins: at the start, or behind a part of the log that is lost.
#[derive(Clone, Copy, Debug)]
struct Origin {
    /// Heat given off before, as recorded [J].
    convected: f64,
    radiated: f64,
    thermal: f64,
    reaction_heat: f64,
}

/// The sums of a log so far.
#[derive(Clone, Debug)]
pub struct Books {
    /// From impacts.
    pub impacts: Impacts,
    ways: Ways,
    relative: f64,
    /// h_c a_s of every particle, length n [W/K], and the ambient temperature [K].
    convection: (Vec<f64>, f64),
    /// B eps a_s of every particle, length n [W/K^4], and the surroundings' temperature [K].
    radiation: (Vec<f64>, f64),
    capacity: Vec<f64>,
    /// Whether impacts are missing since the last recorded sums.
    impacts_lost: bool,
    origin: Option<Origin>,
    quadrature: Option<Quadrature>,
    /// Reaction heat of every particle since the last state, length n [J].
    heat: Vec<f64>,
}

/// Heat flows summed over recorded states by the trapezoidal rule, with bounds of its error.
#[derive(Clone, Debug, Default)]
struct Quadrature {
    t: f64,
    temperatures: Vec<f64>,
    convected: Rounded<f64>,
    radiated: Rounded<f64>,
}

impl Books {
    /// Of a run from its start.
    pub fn new(scene: &Scene, particles: &Particles, single: bool) -> Self {
        let thermal = scene.thermal.as_ref();
        let convection = thermal.and_then(|t| t.convection).filter(|convection| convection.coefficient > 0.0);
        let radiation = thermal.and_then(|t| t.radiation).filter(|radiation| radiation.emissivity > 0.0);
        let ways = match (convection, radiation) {
            (None, None) => Ways::None,
            (Some(_), None) => Ways::Convection,
            (None, Some(_)) => Ways::Radiation,
            (Some(_), Some(_)) => Ways::Both,
        };
        let constant = match scene.model {
            ModelKind::Paper => STEFAN_BOLTZMANN_PAPER,
            ModelKind::Consistent => STEFAN_BOLTZMANN,
        };
        let n = if ways == Ways::Both { particles.len() } else { 0 };
        let areas = |factor: f64| -> Vec<f64> {
            particles.radius[..n].iter().map(|b| factor * 4.0 * std::f64::consts::PI * b * b).collect()
        };
        Self {
            impacts: Impacts::default(),
            ways,
            relative: if single { SINGLE } else { DOUBLE },
            convection: (areas(convection.map_or(0.0, |c| c.coefficient)), convection.map_or(0.0, |c| c.ambient)),
            radiation: (
                areas(radiation.map_or(0.0, |r| constant * r.emissivity)),
                radiation.map_or(0.0, |r| r.surroundings),
            ),
            capacity: particles.mass[..n].iter().map(|m| m * thermal.map_or(0.0, |t| t.heat_capacity)).collect(),
            impacts_lost: false,
            origin: None,
            quadrature: None,
            heat: vec![0.0; n],
        }
    }

    /// How the scene's particles give off heat.
    pub fn ways(&self) -> Ways {
        self.ways
    }

    /// Takes the impacts of a step.
    pub fn add_impacts(&mut self, impacts: &[Impact]) {
        for impact in impacts {
            self.impacts.add(impact);
            let partner = match impact.partner {
                Partner::Particle(j) => Some(j),
                Partner::Wall(_) => None,
            };
            for k in [Some(impact.particle), partner].into_iter().flatten() {
                if let Some(heat) = self.heat.get_mut(k as usize) {
                    *heat += impact.heat.abs();
                }
            }
        }
    }

    /// Takes note of a part of the log that is lost: sums go on from the next that are recorded.
    pub fn lose(&mut self) {
        self.impacts_lost = true;
        self.origin = None;
        self.quadrature = None;
    }

    /// Compares recorded sums with those of impacts; where a part is lost before them, they are taken over instead.
    /// Returns whether they can be compared.
    pub fn meet(&mut self, totals: &Totals) -> bool {
        if !std::mem::take(&mut self.impacts_lost) {
            return true;
        }
        let taken = |value: f64| Rounded { value, tolerance: DOUBLE * value.abs() };
        self.impacts.reaction_heat = taken(totals.reaction_heat);
        self.impacts.impact_loss = taken(totals.impact_loss);
        self.impacts.friction_loss = taken(totals.friction_loss);
        false
    }

    /// Heat given off up to a state, `steps` into the run; `None` where the state is the first behind a lost part.
    pub fn given_off(&mut self, state: &StateValues, recorded: Option<&Ledger>, steps: u64) -> Option<GivenOff> {
        let (thermal, reaction_heat) = (state.held.thermal, self.impacts.reaction_heat.value);
        let begin =
            |totals: Totals| Origin { convected: totals.convected, radiated: totals.radiated, thermal, reaction_heat };
        let origin = match (self.origin, recorded) {
            (Some(origin), _) => origin,
            // Nothing is given off before the start.
            (None, _) if state.step == 0 => *self.origin.insert(begin(Totals::default())),
            (None, Some(ledger)) if !self.impacts_lost => {
                self.origin = Some(begin(ledger.totals));
                self.integrate(state);
                return None;
            }
            (None, _) => return None,
        };
        self.integrate(state);
        let before = origin.convected + origin.radiated;
        let released = reaction_heat - origin.reaction_heat;
        // Every step rounds temperatures once.
        let relative = self.relative.max(steps as f64 * f64::EPSILON);
        let sizes = thermal.abs() + origin.thermal.abs() + before.abs() + released.abs();
        let all = Rounded {
            value: before + released - (thermal - origin.thermal),
            tolerance: relative * sizes + self.impacts.reaction_heat.tolerance,
        };
        let none = Rounded::default();
        Some(match self.ways {
            Ways::None => GivenOff { convected: none, radiated: none, all: none },
            Ways::Convection => GivenOff { convected: all, radiated: none, all },
            Ways::Radiation => GivenOff { convected: none, radiated: all, all },
            Ways::Both => self.split(&origin, all),
        })
    }

    /// Convection and radiation by quadrature, made to add up to what is known to be given off. What the two leave is
    /// shared in proportion to their error bounds E; the error of either is then at most 2 E_c E_r/(E_c + E_r).
    fn split(&self, origin: &Origin, all: Rounded<f64>) -> GivenOff {
        let (convected, radiated) =
            self.quadrature.as_ref().map_or_else(Default::default, |sums| (sums.convected, sums.radiated));
        let left = all.value - origin.convected - origin.radiated - convected.value - radiated.value;
        let bounds = convected.tolerance + radiated.tolerance;
        let share = if bounds > 0.0 { convected.tolerance / bounds } else { 0.5 };
        let error = if bounds > 0.0 { 2.0 * share * radiated.tolerance } else { 0.0 } + all.tolerance;
        let rounded = |value| Rounded { value, tolerance: error };
        GivenOff {
            convected: rounded(origin.convected + convected.value + share * left),
            radiated: rounded(origin.radiated + radiated.value + (1.0 - share) * left),
            all,
        }
    }

    /// Adds the heat flows between the last state and this one.
    ///
    /// Between impacts a temperature, and with it each flow, tends to its equilibrium without turning: the trapezoidal
    /// rule is off by half the difference of its ends at most. A particle heated by a reaction in between was nowhere
    /// hotter than its hotter end plus all of that heat, nor colder than its end less that.
    fn integrate(&mut self, state: &StateValues) {
        if self.ways != Ways::Both {
            return;
        }
        let mut next = self.quadrature.take().unwrap_or_default();
        if next.temperatures.len() == state.temperatures.len() {
            let dt = state.t - next.t;
            for (i, (&before, &after)) in next.temperatures.iter().zip(&state.temperatures).enumerate() {
                let heated = self.heat[i] / self.capacity[i];
                let hottest = before.max(after) + heated;
                let coldest = before.min(after - heated).max(0.0);
                let flows = [
                    (&mut next.convected, self.convection.0[i], self.convection.1, 1),
                    (&mut next.radiated, self.radiation.0[i], self.radiation.1, 4),
                ];
                for (sum, factor, outside, power) in flows {
                    let flow = |theta: f64| factor * (theta.powi(power) - outside.powi(power));
                    sum.value += 0.5 * dt * (flow(before) + flow(after));
                    let between = if heated > 0.0 { 1.0 } else { 0.5 };
                    sum.tolerance += between * dt * (flow(hottest) - flow(coldest)).abs();
                }
            }
        }
        next.t = state.t;
        next.temperatures.clone_from(&state.temperatures);
        self.heat.fill(0.0);
        self.quadrature = Some(next);
    }
}
