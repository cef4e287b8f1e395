//! What was recorded against what was recomputed, quantity by quantity.

/// A quantity that is recomputed, or that a log alone can tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Term {
    /// Kinetic energy.
    Kinetic,
    /// Near-field potential.
    NearField,
    /// Binding potential.
    Binding,
    /// Potential of gravity and electric field.
    External,
    /// Thermal energy.
    Thermal,
    /// Reaction heat.
    ReactionHeat,
    /// Heat lost by radiation.
    Radiated,
    /// Heat lost by convection.
    Convected,
    /// Energy lost to normal impulses.
    ImpactLoss,
    /// Energy lost to friction in impacts.
    FrictionLoss,
    /// Energy lost in contacts taken as resting.
    RestingLoss,
    /// Work along periodic directions.
    PeriodicWork,
    /// Energy that nothing explains.
    Residual,
    /// Momentum.
    Momentum,
    /// Angular momentum.
    AngularMomentum,
    /// Momentum given from outside.
    OutsideImpulse,
    /// Number of clusters.
    ClusterCount,
    /// Size of the largest cluster.
    LargestCluster,
    /// Particles that are alone.
    Singletons,
    /// Mean size of clusters.
    MeanClusterSize,
    /// Cluster of every particle.
    Cluster,
    /// Bonded pairs.
    Bonds,
    /// Contraction of the iteration.
    Contraction,
}

/// Where a value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Label {
    /// From states, impacts, iterations and the scene.
    Recomputed,
    /// From recorded states, as a sum over the times between them; good to the error that is stated.
    Quadrature,
    /// Taken from the log.
    RecordedOnly,
}

impl Label {
    /// In words.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Recomputed => "recomputed",
            Self::Quadrature => "quadrature",
            Self::RecordedOnly => "recorded only",
        }
    }
}

impl Term {
    /// All, in the order of reports.
    pub const ALL: [Self; 23] = [
        Self::Kinetic,
        Self::NearField,
        Self::Binding,
        Self::External,
        Self::Thermal,
        Self::ReactionHeat,
        Self::Radiated,
        Self::Convected,
        Self::ImpactLoss,
        Self::FrictionLoss,
        Self::RestingLoss,
        Self::PeriodicWork,
        Self::Residual,
        Self::Momentum,
        Self::AngularMomentum,
        Self::OutsideImpulse,
        Self::ClusterCount,
        Self::LargestCluster,
        Self::Singletons,
        Self::MeanClusterSize,
        Self::Cluster,
        Self::Bonds,
        Self::Contraction,
    ];

    /// Its name in reports and JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Kinetic => "kinetic",
            Self::NearField => "near_field",
            Self::Binding => "binding",
            Self::External => "external",
            Self::Thermal => "thermal",
            Self::ReactionHeat => "reaction_heat",
            Self::Radiated => "radiated",
            Self::Convected => "convected",
            Self::ImpactLoss => "impact_loss",
            Self::FrictionLoss => "friction_loss",
            Self::RestingLoss => "resting_loss",
            Self::PeriodicWork => "periodic_work",
            Self::Residual => "residual",
            Self::Momentum => "momentum",
            Self::AngularMomentum => "angular_momentum",
            Self::OutsideImpulse => "outside_impulse",
            Self::ClusterCount => "clusters",
            Self::LargestCluster => "largest_cluster",
            Self::Singletons => "singletons",
            Self::MeanClusterSize => "mean_cluster_size",
            Self::Cluster => "cluster",
            Self::Bonds => "bonds",
            Self::Contraction => "contraction",
        }
    }

    /// The channel, or column, that holds the recorded value.
    #[must_use]
    pub fn channel(self) -> &'static str {
        match self {
            Self::ClusterCount | Self::LargestCluster | Self::Singletons | Self::MeanClusterSize => "/clusters",
            Self::Cluster => "/particles.cluster",
            Self::Bonds | Self::Contraction => "/diagnostics",
            _ => "/energy",
        }
    }

    /// Its unit; empty for numbers.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Momentum | Self::OutsideImpulse => "kg m/s",
            Self::AngularMomentum => "kg m^2/s",
            _ if self.channel() == "/energy" => "J",
            _ => "",
        }
    }
}

/// A recorded and a recomputed value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Time [s].
    pub t: f64,
    /// Step number.
    pub step: u64,
    /// Component of a vector, or number of a particle.
    pub index: Option<usize>,
    /// What the log says.
    pub recorded: f64,
    /// What comes out.
    pub recomputed: f64,
    /// How far the two may be apart.
    pub tolerance: f64,
}

impl Difference {
    /// |recorded - recomputed|; infinite where only one of the two is a finite number, or they are infinities of unlike
    /// sign.
    #[must_use]
    pub fn size(&self) -> f64 {
        let (a, b) = (self.recorded, self.recomputed);
        if a == b || (a.is_nan() && b.is_nan()) {
            return 0.0;
        }
        let size = (a - b).abs();
        if size.is_nan() { f64::INFINITY } else { size }
    }

    /// Whether the two agree.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.size() <= self.tolerance || self.size() == 0.0
    }

    /// The difference over what is allowed; infinite where nothing is.
    fn excess(&self) -> f64 {
        let size = self.size();
        if size == 0.0 { 0.0 } else { size / self.tolerance.max(0.0) }
    }
}

/// How a quantity compares over the whole log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Where its value comes from.
    pub label: Label,
    /// Values that were compared.
    pub compared: u64,
    /// The difference that is largest against its tolerance; of equals the first.
    pub largest: Option<Difference>,
    /// The first that is too large.
    pub first: Option<Difference>,
}

impl Comparison {
    /// Whether all that was compared agrees; `None` where nothing was.
    #[must_use]
    pub fn agrees(&self) -> Option<bool> {
        (self.compared > 0).then_some(self.first.is_none())
    }
}

/// All comparisons.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    terms: [Comparison; Term::ALL.len()],
}

impl Default for Agreement {
    fn default() -> Self {
        let none = Comparison { label: Label::Recomputed, compared: 0, largest: None, first: None };
        Self { terms: [none; Term::ALL.len()] }
    }
}

impl Agreement {
    /// How a quantity compares.
    #[must_use]
    pub fn of(&self, term: Term) -> &Comparison {
        &self.terms[term as usize]
    }

    /// All quantities with how they compare.
    pub fn terms(&self) -> impl Iterator<Item = (Term, &Comparison)> {
        Term::ALL.iter().map(|&term| (term, self.of(term)))
    }

    /// Whether nothing that was compared disagrees.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.terms.iter().all(|comparison| comparison.first.is_none())
    }

    pub(super) fn label(&mut self, term: Term, label: Label) {
        self.terms[term as usize].label = label;
    }

    pub(super) fn compare(&mut self, term: Term, difference: Difference) {
        let comparison = &mut self.terms[term as usize];
        comparison.compared += 1;
        if comparison.largest.is_none_or(|held| difference.excess() > held.excess()) {
            comparison.largest = Some(difference);
        }
        if comparison.first.is_none() && !difference.agrees() {
            comparison.first = Some(difference);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_stand_where_their_number_says() {
        for (k, term) in Term::ALL.into_iter().enumerate() {
            assert_eq!(term as usize, k, "{}", term.name());
        }
    }

    #[test]
    fn numbers_that_are_none_are_told_apart() {
        let agrees = |recorded, recomputed| {
            Difference { t: 0.0, step: 0, index: None, recorded, recomputed, tolerance: 0.1 }.agrees()
        };
        assert!(agrees(1.0, 1.05) && agrees(f64::NAN, f64::NAN) && agrees(f64::INFINITY, f64::INFINITY));
        assert!(!agrees(1.0, 1.2) && !agrees(f64::NAN, 1.0) && !agrees(1.0, f64::NAN));
        assert!(!agrees(f64::INFINITY, 1.0) && !agrees(f64::INFINITY, f64::NEG_INFINITY));
    }
}
