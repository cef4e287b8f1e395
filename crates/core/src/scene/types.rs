//! The scene: every quantity a scene file may name, with units and ranges.
//!
//! These types are the single source of the file format: the JSON Schema is generated from them (doc comments become
//! descriptions, `extend` attributes become ranges) and the checks of a file walk that schema.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A scene: what to simulate, how, and what to record. A section that is absent is an effect that is absent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// A schema reference for editors; ignored.
    #[serde(rename = "$schema", default, skip_serializing)]
    pub schema: Option<String>,
    /// Version of this file format; 1.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 1))]
    pub format: u32,
    /// A short name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// What the scene shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// Which of the two named models is solved.
    #[serde(default)]
    pub model: ModelKind,
    /// Seed of all random numbers [-].
    #[serde(default)]
    #[schemars(extend("minimum" = 0, "maximum" = 9_007_199_254_740_991_u64))]
    pub seed: u64,
    /// Simulated time [s].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub duration: f64,
    /// Where the particles come from: exactly one source.
    pub particles: ParticleSource,
    /// Near-field attraction and repulsion, equation (2).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near_field: Option<NearField>,
    /// Binding force that forms clusters, equation (13).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub binding: Option<Binding>,
    /// Impact, restitution and friction, equations (16)-(35).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<Contact>,
    /// Temperatures, equations (36)-(42). Absent: no temperatures anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thermal: Option<Thermal>,
    /// How clusters are counted where there is no binding.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clusters: Option<ClusterCount>,
    /// Forces from outside the cloud.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub external: Option<External>,
    /// Periodic directions and plane walls.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub domain: Option<Domain>,
    /// Integrator, step control and tolerances, equations (43)-(55).
    #[serde(default)]
    pub solver: Solver,
    /// What is written to the log, and how often.
    #[serde(default)]
    pub record: Record,
}

/// The two named models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// The paper's scheme, literal where the literal thing works; reproduces its tables.
    Paper,
    /// The same physics with a limit as the step goes to zero, so that an error can be stated.
    #[default]
    Consistent,
}

/// A vector of three components.
pub type Vector = [f64; 3];

/// Where the particles come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ParticleSource {
    /// Equal spheres placed at random in a cube, without overlap.
    RandomCube(RandomCube),
    /// Every particle written out.
    List(#[schemars(length(min = 1))] Vec<ListedParticle>),
    /// A CSV file with the columns of `agglo export` (of several times the last).
    File(FileSource),
    /// A state recorded in a log.
    Log(LogSource),
}

/// Equal spheres placed at random in a cube, without overlap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomCube {
    /// Number of particles [-].
    #[schemars(extend("minimum" = 1, "maximum" = 100_000_000))]
    pub count: u32,
    /// Edge of the cube that holds the centres [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub side: f64,
    /// Radius over side/count^(1/3) [-]; this or `radius`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius_ratio: Option<f64>,
    /// Radius [m]; this or `radius_ratio`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: Option<f64>,
    /// Mass density of the spheres [kg/m^3].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub density: f64,
    /// Initial temperature [K]; needed by `thermal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub temperature: Option<f64>,
    /// Mean velocity [m/s].
    #[serde(default)]
    pub velocity_mean: Vector,
    /// Half width of the uniform distribution of each velocity component [m/s].
    #[serde(default)]
    #[schemars(extend("items" = {"type": "number", "minimum": 0.0}))]
    pub velocity_spread: Vector,
    /// Charge of every particle, or charges dealt in turn [C].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub charge: Option<ChargeDeal>,
}

/// One charge for all, or several dealt in turn [C].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ChargeDeal {
    /// The same charge for every particle [C].
    Same(f64),
    /// Particle k gets charge k modulo the length [C].
    InTurn(#[schemars(length(min = 1))] Vec<f64>),
}

/// One particle, written out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ListedParticle {
    /// Position of the centre [m].
    pub position: Vector,
    /// Velocity [m/s].
    #[serde(default)]
    pub velocity: Vector,
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Mass density [kg/m^3]; this or `mass`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub density: Option<f64>,
    /// Mass [kg]; this or `density`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub mass: Option<f64>,
    /// Temperature [K]; needed by `thermal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub temperature: Option<f64>,
    /// Charge [C].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub charge: Option<f64>,
}

/// A CSV file of particles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSource {
    /// Path; a relative one starts at the scene's folder.
    pub path: String,
}

/// A state recorded in a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogSource {
    /// Path; a relative one starts at the scene's folder.
    pub path: String,
    /// The last recorded state at or before this time is taken [s].
    #[schemars(extend("minimum" = 0.0))]
    pub time: f64,
}

/// Near field, equation (2): force on i along n_ij is alpha1 s^-beta1 - alpha2 s^-beta2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearField {
    /// Attraction alpha1, beta1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attraction: Option<PowerTerm>,
    /// Repulsion alpha2, beta2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repulsion: Option<PowerTerm>,
    /// Pair weight that multiplies the strengths.
    #[serde(default)]
    pub weight: Weight,
    /// Distance beyond which the near field is zero.
    #[serde(default)]
    pub cutoff: Cutoff,
    /// Distance from which the potential is switched smoothly to zero at the cut-off [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub switch_from: Option<f64>,
    /// Relative force error allowed to a long-range method [-]; absent: forces are summed exactly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub accuracy: Option<f64>,
}

/// One power-law term strength * weight * s^-exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerTerm {
    /// Strength before the pair weight [N m^exponent per unit of weight].
    #[schemars(extend("minimum" = 0.0))]
    pub strength: f64,
    /// Exponent beta of the force [-].
    #[schemars(extend("minimum" = 0.0, "maximum" = 100.0))]
    pub exponent: f64,
    /// Pair weight of this term; absent: the near field's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight: Option<Weight>,
}

/// Pair weight w_ij that multiplies a strength.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
    /// 1.
    #[default]
    None,
    /// m_i m_j [kg^2], the paper's choice.
    MassProduct,
    /// -q_i q_j for attraction, |q_i q_j| for repulsion and binding [C^2].
    ChargeProduct,
}

/// Where the near field ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Cutoff {
    /// By name.
    Named(NamedCutoff),
    /// At this distance [m].
    Distance(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
}

impl Default for Cutoff {
    fn default() -> Self {
        Self::Named(NamedCutoff::None)
    }
}

/// Cut-offs with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NamedCutoff {
    /// At the inflection of the potential, equation (12), the paper's choice.
    Inflection,
    /// No cut-off: every pair interacts.
    None,
}

/// Binding, equation (13): an extra attraction strength * weight * s^-exponent while s <= range (b_i + b_j).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Binding {
    /// Strength alpha_a before the pair weight [N m^exponent per unit of weight].
    #[schemars(extend("minimum" = 0.0))]
    pub strength: f64,
    /// Exponent beta_a [-].
    #[schemars(extend("minimum" = 0.0, "maximum" = 100.0))]
    pub exponent: f64,
    /// Activation distance over the sum of the radii, delta_a [-].
    #[schemars(extend("minimum" = 1.0))]
    pub range: f64,
    /// Pair weight; absent: the near field's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight: Option<Weight>,
}

/// Impact between particles, and of particles with walls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Coefficient of restitution: a number, or its dependence on velocity and temperature.
    pub restitution: Restitution,
    /// Stick-slip friction; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<Friction>,
    /// How long an impact lasts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<ImpactDuration>,
    /// When impacts happen: at step ends (`step`) or located in time (`located`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution: Option<ContactResolution>,
    /// Approaches slower than this are taken as resting: e = 0, no heat [m/s]. Model `consistent` only; default 0.01.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0))]
    pub rest_speed: Option<f64>,
}

/// Coefficient of restitution, equation (35).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Restitution {
    /// The same for every impact [-].
    Constant(#[schemars(extend("minimum" = 0.0, "maximum" = 1.0))] f64),
    /// Depending on approach speed and temperature.
    Law(RestitutionLaw),
}

/// e = max(e0 (1 - u/v_star), e_min) max(1 - theta/theta_star, 0), equation (35).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RestitutionLaw {
    /// Restitution of a slow, cold impact [-].
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub e0: f64,
    /// Lower limit of the velocity-dependent factor [-]; default 0.01, or e0 where that is smaller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub e_min: Option<f64>,
    /// Approach speed at which the velocity-dependent factor vanishes [m/s]; absent: no dependence on velocity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub v_star: Option<f64>,
    /// Temperature at which restitution vanishes [K]; absent: no dependence on temperature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub theta_star: Option<f64>,
}

/// Stick-slip friction, equations (32)-(33).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Friction {
    /// Static coefficient mu_s [-].
    #[serde(rename = "static")]
    #[schemars(extend("minimum" = 0.0))]
    pub static_: f64,
    /// Dynamic coefficient mu_d <= mu_s [-].
    #[schemars(extend("minimum" = 0.0))]
    pub dynamic: f64,
}

/// Duration of an impact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ImpactDuration {
    /// A fraction gamma of the time step [-]; model `paper` only where there is a reaction.
    StepFraction(#[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))] f64),
    /// A time [s].
    Seconds(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
}

/// When impacts happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactResolution {
    /// At the ends of time steps.
    Step,
    /// At their own instants, located in time.
    Located,
}

/// Temperatures and heat exchange.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Thermal {
    /// Heat capacity C [J/(kg K)].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub heat_capacity: f64,
    /// Radiation to far surroundings, equation (41).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radiation: Option<Radiation>,
    /// Convection to an ambient gas, equation (41).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convection: Option<Convection>,
    /// Heat of surface reactions set off by impacts, equation (39).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reaction: Option<Reaction>,
}

/// Radiation to far surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Radiation {
    /// Emissivity epsilon [-].
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub emissivity: f64,
    /// Temperature theta_s of the surroundings [K].
    #[schemars(extend("minimum" = 0.0))]
    pub surroundings: f64,
}

/// Convection to an ambient gas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Convection {
    /// Heat transfer coefficient h_c [W/(m^2 K)].
    #[schemars(extend("minimum" = 0.0))]
    pub coefficient: f64,
    /// Temperature theta_0 of the gas [K].
    #[schemars(extend("minimum" = 0.0))]
    pub ambient: f64,
}

/// Surface reaction heat kappa min(|I_n|/I*, 1) pi b^2, equation (39).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reaction {
    /// Reaction energy kappa per contact area [J/m^2].
    #[schemars(extend("minimum" = 0.0))]
    pub energy_per_area: f64,
    /// Mean impact force I* at which the reaction is complete [N].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub force_scale: f64,
}

/// Clusters of scenes without binding.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClusterCount {
    /// Pairs closer than range (b_i + b_j) belong together [-].
    #[schemars(extend("minimum" = 1.0))]
    pub range: f64,
}

/// Forces from outside the cloud.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct External {
    /// Acceleration of gravity [m/s^2].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<Vector>,
    /// Electric field [V/m]; needs charges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub electric_field: Option<Vector>,
}

/// Periodic directions and plane walls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Lengths of the periodic box, which starts at the origin [m]; null: an open direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("items" = {"type": ["number", "null"], "exclusiveMinimum": 0.0}))]
    pub periodic: Option<[Option<f64>; 3]>,
    /// Plane walls.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<Wall>,
}

/// A plane wall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// A point of the plane [m].
    pub point: Vector,
    /// Normal, into the side where the particles are; any length but zero [-].
    pub normal: Vector,
}

/// Integrator, step control and tolerances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Time integrator; default `backward-euler` in `paper`, `velocity-verlet` in `consistent`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integrator: Option<IntegratorKind>,
    /// How the coupled equations of a step are solved.
    pub method: SolutionMethod,
    /// Step size.
    pub step: StepSize,
    /// Tolerances of both fields, equations (53)-(54).
    pub tolerance: Tolerance,
    /// Bound K_d on the iterations of a step [-].
    #[schemars(extend("minimum" = 1, "maximum" = 100_000))]
    pub max_iterations: u32,
}

impl Default for Solver {
    fn default() -> Self {
        Self {
            integrator: None,
            method: SolutionMethod::default(),
            step: StepSize::default(),
            tolerance: Tolerance::default(),
            max_iterations: 100,
        }
    }
}

/// Time integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum IntegratorKind {
    /// First order, damps vibrations; the paper's (49).
    BackwardEuler,
    /// Second order, implicit.
    Trapezoidal,
    /// Second order, explicit in the positions.
    VelocityVerlet,
}

/// How the coupled equations of a step are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SolutionMethod {
    /// Staggered fixed-point iteration, equation (55).
    #[default]
    Staggered,
    /// Newton's method, the paper's Remark 3.
    Newton,
}

/// Step size: adaptive between `min` and `max`, or `fixed`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StepSize {
    /// First step [s]; default 1e-3, or `max` where that is smaller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub initial: Option<f64>,
    /// Largest step, the paper's dt_lim [s]; default 1e-2, or `initial` where that is larger.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub max: Option<f64>,
    /// Smallest step; a run that needs a smaller one fails [s]; default 1e-10, or a millionth of `initial` where that is smaller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub min: Option<f64>,
    /// A step that never changes [s]; excludes the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub fixed: Option<f64>,
}

/// Tolerances of both fields.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tolerance {
    /// Positions, TOL_r [-]: relative to the positions in `paper`, to the mean diameter in `consistent`.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub position: f64,
    /// Temperatures, TOL_theta, relative [-].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub temperature: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { position: 1e-6, temperature: 1e-6 }
    }
}

/// What is written to the log, and how often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Record {
    /// States are recorded every so many steps [-]; this or `interval`; default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1))]
    pub every_steps: Option<u64>,
    /// States are recorded at the first step end after every such interval of simulated time [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub interval: Option<f64>,
    /// Number format of recorded states.
    pub precision: Precision,
    /// Rate of the sphere channel in log time [Hz]; 0: off.
    #[schemars(extend("minimum" = 0.0))]
    pub markers: f64,
    /// Compression of the log's chunks.
    pub compression: Compression,
    /// A checkpoint every so many steps [-].
    #[schemars(extend("minimum" = 1))]
    pub checkpoint_every: u64,
    /// Log time over simulated time [-].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub time_scale: f64,
}

impl Default for Record {
    fn default() -> Self {
        Self {
            every_steps: None,
            interval: None,
            precision: Precision::F64,
            markers: 30.0,
            compression: Compression::Zstd,
            checkpoint_every: 1000,
            time_scale: 1.0,
        }
    }
}

/// Number format of recorded states.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// 64-bit floats: replay is exact.
    F64,
    /// 32-bit floats: half the size.
    F32,
}

/// Compression of the log's chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Compression {
    /// Zstandard, level 1.
    Zstd,
    /// LZ4.
    Lz4,
    /// None.
    None,
}

fn one() -> u32 {
    1
}
