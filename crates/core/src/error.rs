//! What can go wrong when a scene is set up or run. Errors name the particle, the time, the value and what to do next.

use crate::impact::Partner;
use crate::observer::ObserverError;
use crate::scene::Problem;

/// A scene that cannot be set up.
#[derive(Clone, Debug, PartialEq)]
pub struct SetupError {
    /// What is wrong, each with the JSON pointer it concerns; never empty.
    pub problems: Vec<Problem>,
}

impl std::fmt::Display for SetupError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, problem) in self.problems.iter().enumerate() {
            if k > 0 {
                writeln!(f)?;
            }
            write!(f, "{problem}")?;
        }
        Ok(())
    }
}

impl std::error::Error for SetupError {}

impl From<Problem> for SetupError {
    fn from(problem: Problem) -> Self {
        Self { problems: vec![problem] }
    }
}

/// A run that could not be finished. The observer has seen every step before it.
#[derive(Debug)]
pub enum RunError {
    /// The step fell below its minimum without being accepted.
    StepTooSmall {
        /// Time [s].
        time: f64,
        /// Step that would have been next [s].
        dt: f64,
        /// Smallest step allowed [s].
        min: f64,
        /// Why the last attempt was rejected.
        cause: crate::diagnostics::RejectionCause,
        /// Particles that changed most in the last iteration.
        particles: Vec<u32>,
        /// Violation ratio reached [-].
        violation: f64,
        /// What to try.
        advice: String,
    },
    /// A step was rejected too often.
    TooManyRejections {
        /// Time [s].
        time: f64,
        /// Step of the last attempt [s].
        dt: f64,
        /// Attempts made.
        attempts: u64,
        /// Why the last attempt was rejected.
        cause: crate::diagnostics::RejectionCause,
        /// Particles that changed most in the last iteration.
        particles: Vec<u32>,
        /// Violation ratio reached [-].
        violation: f64,
        /// What to try.
        advice: String,
    },
    /// A value stopped being a finite number.
    NotFinite {
        /// Time [s].
        time: f64,
        /// Particle.
        particle: u32,
        /// Which quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// What to try.
        advice: String,
    },
    /// A contact came to rest under a scheme that knows impacts only.
    Resting {
        /// Time [s].
        time: f64,
        /// The particle.
        particle: u32,
        /// What it rests on.
        partner: Partner,
    },
    /// The observer failed, for instance on a full disk.
    Observer(ObserverError),
}

impl std::fmt::Display for RunError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        fn names(particles: &[u32]) -> String {
            match particles {
                [] => "no particle in particular".to_owned(),
                [one] => format!("particle {one}"),
                [most @ .., last] => {
                    let most: Vec<String> = most.iter().map(ToString::to_string).collect();
                    format!("particles {} and {last}", most.join(", "))
                }
            }
        }
        match self {
            Self::StepTooSmall { time, dt, min, cause, particles, violation, advice } => write!(
                f,
                "the step fell below {min:e} s at t = {time} s (next: {dt:e} s): {} ({cause}, {violation:.3e} times \
                 what is allowed); {advice}",
                names(particles)
            ),
            Self::TooManyRejections { time, dt, attempts, cause, particles, violation, advice } => write!(
                f,
                "{attempts} attempts at the step from t = {time} s were rejected, the last with dt = {dt:e} s: {} \
                 ({cause}, {violation:.3e} times what is allowed); {advice}",
                names(particles)
            ),
            Self::NotFinite { time, particle, quantity, value, advice } => {
                write!(f, "the {quantity} of particle {particle} became {value} at t = {time} s; {advice}")
            }
            Self::Resting { time, particle, partner } => {
                let partner = match partner {
                    Partner::Particle(j) => format!("particle {j}"),
                    Partner::Wall(w) => format!("wall {w}"),
                };
                write!(
                    f,
                    "particle {particle} comes to rest on {partner} at t = {time} s: collocation schemes solve impacts, but \
                     no resting contacts; try \"velocity-verlet\" as solver.integrator, or contact.resolution \"step\""
                )
            }
            Self::Observer(source) => write!(f, "{source}"),
        }
    }
}

impl std::error::Error for RunError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Observer(source) => Some(source.as_ref()),
            _ => None,
        }
    }
}

impl std::fmt::Display for crate::diagnostics::RejectionCause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotConverged => "the iteration did not converge",
            Self::NotFinite => "a value stopped being finite",
            Self::LocalError => "the local error exceeded the tolerance",
            Self::Travel => "a particle moved too far in one step",
        })
    }
}
