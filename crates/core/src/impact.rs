//! One impact, as it is reported.

/// What a particle hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Particle j.
    Particle(u32),
    /// Wall w, in the order of the scene.
    Wall(u32),
}

/// One impact of particle i with a partner. Vectors act on i or point away from i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Time [s].
    pub time: f64,
    /// Particle i.
    pub particle: u32,
    /// What it hit.
    pub partner: Partner,
    /// Unit normal n_ij from i to its partner [-].
    pub normal: [f64; 3],
    /// Rate of the gap before, g- (negative: approaching) [m/s].
    pub gap_rate_before: f64,
    /// Rate of the gap after, g+ [m/s].
    pub gap_rate_after: f64,
    /// Tangential velocity of i relative to its partner before, w- [m/s].
    pub tangential_before: [f64; 3],
    /// Tangential velocity of i relative to its partner after, w+ [m/s].
    pub tangential_after: [f64; 3],
    /// Coefficient of restitution e [-].
    pub restitution: f64,
    /// Normal impulse P_n >= 0, pushing the two apart [N s].
    pub normal_impulse: f64,
    /// Tangential impulse P_t on i [N s].
    pub tangential_impulse: [f64; 3],
    /// Whether the contact slipped; sticking otherwise. `None` without friction.
    pub slip: Option<bool>,
    /// Reaction heat given to each particle that took part [J].
    pub heat: f64,
    /// Point of contact [m].
    pub position: [f64; 3],
}

impl Impact {
    /// Kinetic energy lost to the normal impulse, -P_n (g+ + g-)/2 [J].
    #[must_use]
    pub fn normal_loss(&self) -> f64 {
        -0.5 * self.normal_impulse * (self.gap_rate_after + self.gap_rate_before)
    }

    /// Kinetic energy lost to friction, -P_t.(w+ + w-)/2 [J].
    #[must_use]
    pub fn friction_loss(&self) -> f64 {
        (0..3).map(|k| -0.5 * self.tangential_impulse[k] * (self.tangential_after[k] + self.tangential_before[k])).sum()
    }
}
