//! A run that never was: reports with every field set, for tests that need no solver.

use agglo_core::checkpoint::{Checkpoint, Counters};
use agglo_core::collocation::Carried;
use agglo_core::diagnostics::{Level, Notice, RejectedAttempt, RejectionCause, StepDiagnostics};
use agglo_core::impact::{Impact, Partner};
use agglo_core::ledger::{Ledger, Momentum, Totals};
use agglo_core::observer::{Clusters, Observer, Sample, StepReport};
use agglo_core::scene::Scene;
use agglo_core::state::{Columns, Particles, State};
use agglo_record::run::INTERRUPTED;
use agglo_record::{BuildInfo, Options, RecordError, Recorded, Recorder};

/// A small generator of numbers; tests must not depend on the one that places particles.
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(2).wrapping_add(1))
    }

    /// The next number, uniform from -1 to 1 with all of its 53 bits in use.
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub fn three(&mut self) -> [f64; 3] {
        [self.next(), self.next(), self.next()]
    }
}

/// What a scene switches on.
#[derive(Clone, Copy)]
pub struct Kind {
    pub n: usize,
    pub charge: bool,
    pub thermal: bool,
    pub contact: bool,
    pub binding: bool,
    pub domain: bool,
    pub markers: f64,
    pub record: &'static str,
}

/// Every effect at once.
pub const EVERYTHING: Kind = Kind {
    n: 5,
    charge: true,
    thermal: true,
    contact: true,
    binding: true,
    domain: true,
    markers: 30.0,
    record: r#""checkpoint_every": 4"#,
};

/// Nothing but particles that fly.
pub const NOTHING: Kind =
    Kind { charge: false, thermal: false, contact: false, binding: false, domain: false, markers: 0.0, ..EVERYTHING };

impl Kind {
    pub fn scene(&self) -> Scene {
        let mut text = format!(
            r#"{{"name": "a story", "seed": 9007199254740991, "duration": 5.0, "record": {{"markers": {:?}, {}}}"#,
            self.markers, self.record
        );
        if self.binding {
            text += r#", "binding": {"strength": 1.75, "exponent": 1.0, "range": 1.65}"#;
        }
        if self.contact {
            text += r#", "contact": {"restitution": 0.5, "friction": {"static": 0.2, "dynamic": 0.1}}"#;
        }
        if self.thermal {
            text +=
                r#", "thermal": {"heat_capacity": 1000.0, "radiation": {"emissivity": 0.1, "surroundings": 290.0}}"#;
        }
        if self.domain {
            text += r#", "domain": {"periodic": [null, 40.0, 40.0], "walls": [{"point": [-50, 0, 0], "normal": [2, 0, 0]}]}"#;
        }
        let mut list = Vec::new();
        for k in 0..self.n {
            let mut particle = format!(r#"{{"position": [{k}.5, 10, 10.25], "radius": 0.1, "mass": 1.5"#);
            if self.thermal {
                particle += r#", "temperature": 300.5"#;
            }
            if self.charge {
                particle += r#", "charge": -1e-9"#;
            }
            list.push(particle + "}");
        }
        text += &format!(r#", "particles": {{"list": [{}]}}}}"#, list.join(", "));
        Scene::parse(&text, &[]).unwrap_or_else(|problems| panic!("{problems:?}"))
    }

    pub fn particles(&self) -> Particles {
        let column = |start: f64| (0..self.n).map(|k| start + k as f64 * 0.1).collect();
        Particles { radius: column(0.1), mass: column(1.5), charge: self.charge.then(|| column(-0.2)) }
    }

    /// A run of `steps` steps after the start, every step recorded.
    pub fn story(&self, steps: u64) -> Vec<Told> {
        let mut numbers = Numbers::new(self.n as u64);
        let mut state = State {
            position: self.columns(&mut numbers),
            velocity: self.columns(&mut numbers),
            temperature: self.thermal.then(|| (0..self.n).map(|k| 300.0 + k as f64).collect()),
        };
        let dt = 1e-3;
        (0..=steps)
            .map(|step| {
                for k in 0..self.n {
                    state.velocity.add(k, numbers.three().map(|a| a * dt).into());
                    state.position.add(k, state.velocity.get(k) * dt);
                    if let Some(temperature) = &mut state.temperature {
                        temperature[k] += numbers.next();
                    }
                }
                self.told(step, step as f64 * dt, &state, &mut numbers)
            })
            .collect()
    }

    fn columns(&self, numbers: &mut Numbers) -> Columns {
        let mut columns = Columns::default();
        for _ in 0..self.n {
            columns.push(numbers.three());
        }
        columns
    }

    fn told(&self, step: u64, time: f64, state: &State, numbers: &mut Numbers) -> Told {
        let mut ledger = Ledger {
            kinetic: 1.0 + numbers.next(),
            near_field: numbers.next(),
            external: numbers.next(),
            residual: numbers.next() * 1e-12,
            ..Ledger::default()
        };
        if self.thermal {
            ledger.thermal = 1e5 * numbers.next();
            ledger.totals.radiated = numbers.next();
            ledger.totals.convected = numbers.next();
            ledger.totals.reaction_heat = numbers.next();
        }
        let totals = Totals {
            impact_loss: numbers.next(),
            friction_loss: numbers.next(),
            resting_loss: numbers.next(),
            // The sign of zero must survive in a checkpoint.
            periodic_work: -0.0,
            outside_impulse: [numbers.next(), -0.0, numbers.next()],
            ..ledger.totals
        };
        if self.contact {
            ledger.totals = totals;
        }
        let momentum = Momentum { linear: numbers.three(), angular: numbers.three(), residual: 1e-16 };
        let clusters = self.binding.then(|| Clusters {
            of: (0..self.n as u32).map(|k| k / 2).collect(),
            count: self.n as u32 / 2,
            largest: 2,
            singletons: self.n as u32 % 2,
            mean_size: 2.0,
        });
        let single = step.is_multiple_of(3);
        let diagnostics = StepDiagnostics {
            dt: 1e-3,
            position_errors: if single { vec![1e-7] } else { vec![1e-3, 1e-5, numbers.next().abs() * 1e-7] },
            temperature_errors: if self.thermal { vec![1e-4; if single { 1 } else { 3 }] } else { Vec::new() },
            violation: numbers.next().abs(),
            scaling: 1.25,
            contraction: if single { f64::NAN } else { 1e-2 },
            local_error: step.is_multiple_of(2).then_some(1e-9),
            rejected: if step % 4 == 2 { self.rejected() } else { Vec::new() },
            contacts: step % 7,
            resting: step % 2,
            bonds: self.binding.then_some(step + 3),
            rounds: step % 5,
            impact_residual: self.contact.then_some(1e-16),
            fallbacks: self.contact.then_some(step % 2),
            crossings: self.binding.then_some(step % 3),
            pairs_evaluated: 4950 * (step + 1),
        };
        let impacts = if self.contact && step % 2 == 1 { self.impacts(time, numbers) } else { Vec::new() };
        let due = step.is_multiple_of(4);
        let checkpoint = due.then(|| Checkpoint {
            time,
            time_rest: -1e-17,
            step,
            next_dt: 1.1e-3,
            state: state.clone(),
            acceleration: self.columns(numbers),
            list_positions: if step == 0 { Columns::default() } else { self.columns(numbers) },
            totals,
            initial_energy: -0.0,
            initial_momentum: Momentum { linear: [0.0, -0.0, 1.0], angular: numbers.three(), residual: 0.0 },
            counters: Counters {
                steps: step,
                // As `diagnostics`, `rejected` and `impacts` have them.
                iterations: (1..=step).map(|step| if step.is_multiple_of(3) { 1 } else { 3 }).sum(),
                rejected_steps: 4 * (1..=step).filter(|step| step % 4 == 2).count() as u64,
                impacts: if self.contact { 3 * step.div_ceil(2) } else { 0 },
                pair_evaluations: u64::MAX,
                intervals: 4,
                max_overlap: 1e-12,
                largest_momentum: 2.5,
            },
            notices_given: 1 << 63,
            collocation: step.is_multiple_of(8).then(|| Carried {
                dt: -0.0,
                accelerations: vec![self.columns(numbers), self.columns(numbers)],
                position_rest: self.columns(numbers),
                velocity_rest: self.columns(numbers),
            }),
            origin: if step.is_multiple_of(8) { [1048576.0, 0.0, -16.0] } else { [0.0; 3] },
        });
        let level = [Level::Info, Level::Warning, Level::Error][step as usize % 3];
        let notices = if step.is_multiple_of(5) {
            vec![Notice { level, message: format!("step {step}: µ, θ") }]
        } else {
            Vec::new()
        };
        Told {
            time,
            step,
            state: state.clone(),
            diagnostics: (step > 0).then_some(diagnostics),
            impacts,
            sample: Some(Sample { ledger, momentum, clusters }),
            checkpoint,
            notices,
        }
    }

    fn rejected(&self) -> Vec<RejectedAttempt> {
        [RejectionCause::NotConverged, RejectionCause::NotFinite, RejectionCause::LocalError, RejectionCause::Travel]
            .into_iter()
            .enumerate()
            .map(|(k, cause)| RejectedAttempt {
                dt: 1e-3 / (k + 1) as f64,
                cause,
                iterations: 100,
                violation: if k == 1 { f64::INFINITY } else { 17.5 },
                particle: k as u32,
            })
            .collect()
    }

    fn impacts(&self, time: f64, numbers: &mut Numbers) -> Vec<Impact> {
        let impact = |partner, slip, numbers: &mut Numbers| Impact {
            time,
            particle: 0,
            partner,
            normal: numbers.three(),
            gap_rate_before: -numbers.next(),
            gap_rate_after: numbers.next(),
            tangential_before: numbers.three(),
            tangential_after: numbers.three(),
            restitution: 0.5,
            normal_impulse: numbers.next(),
            tangential_impulse: numbers.three(),
            slip,
            heat: numbers.next(),
            position: numbers.three(),
        };
        vec![
            impact(Partner::Particle(1), Some(true), numbers),
            impact(Partner::Particle(4), Some(false), numbers),
            impact(Partner::Wall(0), None, numbers),
        ]
    }
}

/// One step of a story.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    pub time: f64,
    pub step: u64,
    pub state: State,
    pub diagnostics: Option<StepDiagnostics>,
    pub impacts: Vec<Impact>,
    pub sample: Option<Sample>,
    pub checkpoint: Option<Checkpoint>,
    pub notices: Vec<Notice>,
}

impl Told {
    pub fn report<'a>(&'a self, particles: &'a Particles) -> StepReport<'a> {
        StepReport {
            time: self.time,
            step: self.step,
            particles,
            state: &self.state,
            diagnostics: self.diagnostics.as_ref(),
            impacts: &self.impacts,
            sample: self.sample.as_ref(),
            checkpoint: self.checkpoint.as_ref(),
            notices: &self.notices,
        }
    }
}

pub fn build() -> BuildInfo {
    BuildInfo { version: "0.1.0".to_owned(), commit: "0123abc".to_owned() }
}

/// Records a story.
pub fn record<W: std::io::Write>(kind: &Kind, story: &[Told], out: W) -> Result<Recorded, RecordError> {
    tell(Recorder::create(out, &kind.scene(), &build(), Options::default())?, kind, story)
}

/// The same, by a recorder on a thread of its own.
pub fn record_apart<W: std::io::Write + Send + 'static>(
    kind: &Kind,
    story: &[Told],
    out: W,
) -> Result<Recorded, RecordError> {
    tell(Recorder::create(out, &kind.scene(), &build(), Options::default())?.on_own_thread()?, kind, story)
}

fn tell<W: std::io::Write>(mut recorder: Recorder<W>, kind: &Kind, story: &[Told]) -> Result<Recorded, RecordError> {
    let particles = kind.particles();
    for told in story {
        recorder.step(&told.report(&particles)).map_err(|error| match error.downcast::<RecordError>() {
            Ok(error) => *error,
            Err(other) => panic!("a recorder fails with its own error: {other}"),
        })?;
    }
    // A story ends long before its scene does.
    recorder.note(Level::Warning, INTERRUPTED)?;
    recorder.finish()
}

/// The log of a story.
pub fn log(kind: &Kind, steps: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    let recorded = record(kind, &kind.story(steps), &mut bytes).unwrap();
    assert_eq!(recorded.bytes, bytes.len() as u64);
    bytes
}
