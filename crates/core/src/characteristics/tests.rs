//! Characteristics against closed forms and against the paper's numbers.

use super::*;
use crate::state::{Columns, State};

/// Round-off of `pow` and of a handful of products.
const ROUND_OFF: f64 = 1e-14;

fn scene(extra: &str) -> Scene {
    let text = format!(
        r#"{{ "duration": 5.0, {extra} "particles": {{ "list": [{{ "position": [0, 0, 0], "radius": 0.05, "mass": 1, "charge": 1 }}] }} }}"#
    );
    Scene::parse(&text, &[]).unwrap()
}

fn pair(masses: [f64; 2], radius: f64, charges: Option<[f64; 2]>) -> Particles {
    Particles { radius: vec![radius; 2], mass: masses.to_vec(), charge: charges.map(Vec::from) }
}

fn close(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b} to {relative:e}");
}

const PAPER_FIELD: &str = r#""near_field": { "attraction": { "strength": 0.5, "exponent": 1 },
    "repulsion": { "strength": 0.25, "exponent": 2 }, "weight": "mass-product", "cutoff": "inflection" },"#;
const PAPER_BINDING: &str = r#""binding": { "strength": 1.75, "exponent": 1, "range": 1.65 },"#;

#[test]
fn the_papers_distances() {
    let scene = scene(&format!("{PAPER_FIELD}{PAPER_BINDING}"));
    let law = PairLaw::new(&scene, &pair([1.3, 1.3], 0.05, None), 0, 1);
    close(law.equilibrium(false).unwrap().distance, 0.5, ROUND_OFF);
    close(law.inflection().unwrap(), 1.0, ROUND_OFF);
    close(law.equilibrium(true).unwrap().distance, 0.25 / 2.25, ROUND_OFF);
    close(law.activation.unwrap(), 0.165, ROUND_OFF);
    assert_eq!(cutoff_of(&scene, &law), law.inflection());
}

#[test]
fn periods_follow_from_the_closed_form_of_the_stiffness() {
    // At d_e both terms have the size g = alpha1 w d^-beta1, so dF/ds = g (beta2 - beta1)/d.
    let scene = scene(PAPER_FIELD);
    let (m1, m2) = (1.3, 0.7);
    let found = PairLaw::new(&scene, &pair([m1, m2], 0.05, None), 0, 1).equilibrium(false).unwrap();
    let stiffness = 0.5 * m1 * m2 / 0.5 * (2.0 - 1.0) / 0.5;
    close(found.stiffness, stiffness, ROUND_OFF);
    let period = 2.0 * std::f64::consts::PI * (m1 * m2 / (m1 + m2) / stiffness).sqrt();
    close(found.period.unwrap(), period, ROUND_OFF);
}

#[test]
fn stiffness_is_the_derivative_of_the_force() {
    let scene = scene(
        r#""near_field": { "attraction": { "strength": 2, "exponent": 1.5 }, "repulsion": { "strength": 0.3, "exponent": 6.5 } },
           "binding": { "strength": 0.7, "exponent": 3, "range": 2 },"#,
    );
    let law = PairLaw::new(&scene, &pair([1.0, 2.0], 0.1, None), 0, 1);
    for s in [0.3, 0.7, 1.0, 2.5] {
        for bonded in [false, true] {
            // Central differences: error of order h^2 = 1e-10 times the third derivative over the first, below 1e3.
            let h = 1e-5 * s;
            let slope = (law.force(s + h, bonded) - law.force(s - h, bonded)) / (2.0 * h);
            close(slope, law.stiffness(s, bonded), 1e-7);
        }
    }
}

#[test]
fn a_bonded_equilibrium_without_closed_form_is_a_zero_of_the_force() {
    let text = |exponent: f64| {
        format!(
            r#"{PAPER_FIELD} "binding": {{ "strength": 1.75, "exponent": {exponent}, "range": 1.65, "weight": "mass-product" }},"#
        )
    };
    let particles = pair([1.3, 1.3], 0.05, None);
    // beta_a = 0 gives a quadratic: alpha_a s^2 + alpha1 s - alpha2 = 0.
    let law = PairLaw::new(&scene(&text(0.0)), &particles, 0, 1);
    let root = (-0.5 + (0.25f64 + 4.0 * 1.75 * 0.25).sqrt()) / (2.0 * 1.75);
    close(law.equilibrium(true).unwrap().distance, root, ROUND_OFF);
    // A neighbouring exponent tends to the closed form for beta_a = beta1; d(ln d_a)/d(beta_a) is of order 1.
    let near = PairLaw::new(&scene(&text(1.0 + 1e-9)), &particles, 0, 1);
    close(near.equilibrium(true).unwrap().distance, 0.25 / 2.25, 1e-8);
    // Binding as steep as the repulsion and stronger: attraction everywhere.
    let collapsing = PairLaw::new(&scene(&text(2.0)), &particles, 0, 1);
    assert_eq!(collapsing.equilibrium(true), None);
}

#[test]
fn a_steeper_attraction_is_unstable() {
    let scene = scene(
        r#""near_field": { "attraction": { "strength": 1, "exponent": 3 }, "repulsion": { "strength": 1, "exponent": 2 } },"#,
    );
    let particles = pair([1.0, 1.0], 0.05, None);
    let found = PairLaw::new(&scene, &particles, 0, 1).equilibrium(false).unwrap();
    close(found.distance, 1.0, ROUND_OFF);
    assert!(!found.stable && found.period.is_none());
    let survey = survey(&scene, &particles);
    assert_eq!(survey.shortest_period(), None);
    assert!(survey.warnings(&scene)[0].contains("unstable"), "{:?}", survey.warnings(&scene));
}

#[test]
fn equal_exponents_and_missing_terms_have_no_equilibrium() {
    let particles = pair([1.0, 1.0], 0.05, None);
    for field in [
        r#""attraction": { "strength": 1, "exponent": 2 }, "repulsion": { "strength": 1, "exponent": 2 }"#,
        r#""attraction": { "strength": 1, "exponent": 2 }, "repulsion": { "strength": 2, "exponent": 2 }"#,
        r#""attraction": { "strength": 1, "exponent": 2 }"#,
        r#""repulsion": { "strength": 1, "exponent": 2 }"#,
        r#""attraction": { "strength": 0, "exponent": 1 }, "repulsion": { "strength": 1, "exponent": 2 }"#,
    ] {
        let law = PairLaw::new(&scene(&format!(r#""near_field": {{ {field} }},"#)), &particles, 0, 1);
        assert_eq!(law.equilibrium(false), None, "{field}");
    }
}

#[test]
fn only_unlike_charges_have_an_equilibrium() {
    let scene = scene(
        r#""near_field": { "attraction": { "strength": 4, "exponent": 1 }, "repulsion": { "strength": 1, "exponent": 3 },
           "weight": "charge-product" },"#,
    );
    let particles = Particles { radius: vec![0.05; 4], mass: vec![1.0; 4], charge: Some(vec![2.0, -2.0, 2.0, -2.0]) };
    let survey = survey(&scene, &particles);
    assert!(survey.complete && survey.kinds == 2 && survey.pairs.len() == 3);
    let of = |pair: (usize, usize)| survey.pairs.iter().find(|p| p.pair == pair).unwrap().equilibrium;
    close(of((0, 1)).unwrap().distance, 0.5, ROUND_OFF);
    assert_eq!((of((0, 2)), of((1, 3))), (None, None));
}

#[test]
fn a_bond_shorter_than_contact_is_warned_of() {
    let scene = scene(&format!("{PAPER_FIELD}{PAPER_BINDING}"));
    let warnings = |radius: f64| survey(&scene, &pair([1.3, 1.3], radius, None)).warnings(&scene);
    assert_eq!(warnings(0.05), Vec::<String>::new());
    assert!(warnings(0.06)[0].contains("rests in contact"));
    // d_a = 0.111 m beyond 1.65 * 0.02 m: such a pair is bonded only where it is pushed apart.
    assert!(warnings(0.01)[0].contains("beyond the activation distance"));
}

#[test]
fn many_kinds_are_surveyed_by_their_extremes() {
    let scene = scene(PAPER_FIELD);
    let n = 200;
    let mass: Vec<f64> = (0..n).map(|i| 1.0 + f64::from(i)).collect();
    let radius: Vec<f64> = (0..n).map(|i| 0.01 + 1e-4 * f64::from(i)).collect();
    let survey = survey(&scene, &Particles { radius, mass, charge: None });
    assert!(!survey.complete && survey.kinds == 200);
    assert_eq!(survey.pairs.iter().map(|p| p.pair).collect::<Vec<_>>(), vec![(0, 199)]);
}

#[test]
fn the_suggested_step_is_the_tightest_limit() {
    let particles = pair([1.3, 1.3], 0.05, None);
    let moving = |speed: f64| State {
        position: Columns::zeros(2),
        velocity: Columns { x: vec![speed, -speed], y: vec![0.0; 2], z: vec![0.0; 2] },
        temperature: None,
    };
    let step = |text: &str, speed: f64| {
        let scene = scene(text);
        suggest_step(&scene, &particles, &moving(speed), &survey(&scene, &particles))
    };
    let contact = r#""contact": { "restitution": 0.5 },"#;
    let rest = step("", 1.0);
    assert_eq!((rest.seconds, rest.limit), (0.05, StepLimit::Duration));
    let travel = step(contact, 10.0);
    close(travel.seconds, 0.1 * 0.05 / 20.0, ROUND_OFF);
    assert_eq!(travel.limit, StepLimit::Travel);
    let bonded = step(&format!("{PAPER_FIELD}{PAPER_BINDING}"), 0.0);
    let (d, w) = (0.25f64 / 2.25, 1.3 * 1.3);
    close(bonded.seconds, 2.0 * std::f64::consts::PI * (0.65 * d * d / (2.25 * w)).sqrt() / 50.0, 1e-13);
    assert_eq!(bonded.limit, StepLimit::Period);
    let falling = step(&format!(r#"{contact} "external": {{ "gravity": [0, 0, -10] }},"#), 0.0);
    close(falling.seconds, (2.0f64 * 0.005 / 10.0).sqrt(), ROUND_OFF);
    assert_eq!(falling.limit, StepLimit::Fall);
    // From h above a floor a ball arrives at sqrt(2 g h).
    let floor = r#""domain": { "walls": [{ "point": [0, 0, -1], "normal": [0, 0, 2] }] },"#;
    let dropped = step(&format!(r#"{contact} {floor} "external": {{ "gravity": [0, 0, -10] }},"#), 0.0);
    close(dropped.seconds, 0.005 / (2.0f64 * 10.0 * (1.0 - 0.05)).sqrt(), ROUND_OFF);
    assert_eq!(dropped.limit, StepLimit::Travel);
}
