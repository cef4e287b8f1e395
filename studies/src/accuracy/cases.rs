//! The cases of `docs/accuracy.md`: a scene each, and what is tried beyond the usual.

use agglo_core::scene::IntegratorKind;

/// A case.
#[derive(Debug)]
pub struct Case {
    /// Its name, that of its page.
    pub name: &'static str,
    /// Its scene.
    pub scene: &'static str,
    /// Implicit schemes that are also solved by Newton's method.
    pub newton: &'static [IntegratorKind],
    /// Whether schemes of high order are tried: beginning afresh at every one of very many events takes minutes.
    pub high_order: bool,
    /// Whether other programs are asked about it.
    pub peers: bool,
    /// Seeds of the statistics at its end, where it is chaotic.
    pub seeds: u64,
}

/// All cases, in the order of the page.
pub const CASES: &[Case] = &[
    Case {
        name: "two-body",
        scene: include_str!("cases/two-body.json"),
        newton: &[IntegratorKind::BackwardEuler, IntegratorKind::Trapezoidal, IntegratorKind::GaussLegendre],
        high_order: true,
        peers: true,
        seeds: 0,
    },
    Case {
        name: "ten-body",
        scene: include_str!("cases/ten-body.json"),
        newton: &[],
        high_order: true,
        peers: true,
        seeds: 0,
    },
    Case {
        name: "bound-pair",
        scene: include_str!("cases/bound-pair.json"),
        newton: &[],
        high_order: true,
        peers: false,
        seeds: 0,
    },
    Case {
        name: "bouncing-pair",
        scene: include_str!("cases/bouncing-pair.json"),
        newton: &[],
        high_order: true,
        peers: true,
        seeds: 0,
    },
    Case {
        name: "reacting-pair",
        scene: include_str!("cases/reacting-pair.json"),
        newton: &[],
        high_order: true,
        peers: false,
        seeds: 0,
    },
    Case {
        name: "paper-scene",
        scene: include_str!("cases/paper-scene.json"),
        newton: &[],
        high_order: false,
        peers: false,
        seeds: 8,
    },
];

#[cfg(test)]
mod tests {
    use super::CASES;

    #[test]
    fn every_case_is_a_scene() {
        for case in CASES {
            let scene = agglo_core::Scene::parse(case.scene, &[]);
            assert!(scene.is_ok_and(|scene| scene.description.is_some()), "{}", case.name);
        }
    }
}
