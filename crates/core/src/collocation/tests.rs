//! Dense output, and a step solved again shorter, of a real scene.

use crate::Simulation;
use crate::collocation::Collocation;
use crate::scene::Scene;
use crate::stagger::Start;

fn simulation(integrator: &str) -> Simulation {
    let text = format!(
        r#"{{ "duration": 1, "particles": {{ "list": [
            {{ "position": [0, 0, 0], "radius": 0.05, "mass": 1.5, "velocity": [0.1, 0.2, 0] }},
            {{ "position": [0.5, 0, 0.5], "radius": 0.05, "mass": 0.5, "velocity": [-0.3, 0, 0.1] }},
            {{ "position": [0, 0.7, 0.1], "radius": 0.05, "mass": 1, "velocity": [0.1, -0.4, 0.2] }} ] }},
            "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": 1 }},
                "repulsion": {{ "strength": 0.25, "exponent": 2 }} }},
            "solver": {{ "integrator": "{integrator}", "tolerance": {{ "position": 1e-13 }} }} }}"#
    );
    Simulation::new(&Scene::parse(&text, &[]).unwrap()).unwrap()
}

/// Solves a step of dt, and gives the paths of all particles, the positions at its end and the evaluations it took.
fn solve(simulation: &mut Simulation, dt: f64) -> (Vec<super::Path>, crate::state::Columns, u64) {
    let Simulation { stagger, model, particles, state, acceleration, .. } = simulation;
    let start = Start { particles, state, acceleration, time: 0.0 };
    let before = stagger.evaluations;
    assert_eq!(stagger.solve(model, &start, dt, None), crate::convergence::Verdict::Converged);
    let collocation: &Collocation = stagger.collocation.as_deref().unwrap();
    let paths = (0..3).map(|i| collocation.path(&start, dt, i)).collect();
    (paths, stagger.position.clone(), stagger.evaluations - before)
}

#[test]
fn paths_lead_through_the_step() {
    for (integrator, within) in [("gauss-radau", 1e-12), ("gauss-legendre", 1e-8)] {
        let mut simulation = simulation(integrator);
        let dt = 0.1;
        let (paths, end, first) = solve(&mut simulation, dt);
        // The same step again, half as long: quickly, and the same way.
        let (halves, middle, again) = solve(&mut simulation, 0.5 * dt);
        assert!(3 * again <= 2 * first, "{integrator}: {first} evaluations, then {again}");
        for (i, (path, half)) in paths.iter().zip(&halves).enumerate() {
            // Sums of ten terms below 1 m, whose coefficients come from values times up to 1e5.
            assert!((path.position(1.0) - end.get(i)).norm() <= 1e-12);
            assert!((path.position(0.5) - middle.get(i)).norm() <= within, "{integrator}: {i}");
            assert!((path.velocity(0.5) - half.velocity(1.0)).norm() <= 100.0 * within, "{integrator}: {i}");
            assert_eq!(path.position(0.0), simulation.state.position.get(i));
            assert!((path.velocity(0.0) - simulation.state.velocity.get(i)).norm() <= 1e-15);
        }
    }
}
