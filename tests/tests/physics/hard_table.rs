//! The table of hard cases, one test per row: the default scheme is right, another may at most refuse by name, `paper` may
//! fail as listed in `docs/hard-cases.md`, but with numbers that are numbers.

use agglo_tests::hard::{Answer, CASES, Judgement, SCHEMES, Scheme};

fn check(name: &str) {
    let case = CASES.iter().find(|case| case.name == name).unwrap();
    for scheme in SCHEMES {
        let answer = case.answer(scheme);
        let what = format!("{name}, {}: {answer:?}", scheme.name());
        println!("{what}");
        match (scheme, answer.judgement()) {
            (_, Judgement::Right) => {}
            (Scheme::Consistent("velocity-verlet"), _) => panic!("{what}"),
            (_, Judgement::Refused) => assert_ne!(answer, Answer::Refused(String::new())),
            (Scheme::Paper, Judgement::Wrong) => {}
            (_, Judgement::Wrong) => panic!("{what}"),
        }
    }
}

macro_rules! rows {
    ($($name:ident),* $(,)?) => {
        $(#[test]
        fn $name() {
            check(stringify!($name));
        })*

        #[test]
        fn every_row_has_its_test() {
            let names: Vec<&str> = CASES.iter().map(|case| case.name).collect();
            assert_eq!(names, [$(stringify!($name)),*]);
        }
    };
}

rows![
    ten_thousand_periods,
    head_on,
    oblique,
    faster_than_a_diameter,
    break_shot,
    cradle,
    collapse_of_three,
    ball_to_rest,
    slow_decay,
    attracted_pair,
    resting_cluster,
    orbit_with_friction,
    overlap,
    violent_release,
    crossings,
    tiny_hot_sphere,
    beyond_theta_star,
    free_cooling,
    permuted,
    mirrored,
    shifted,
    two_halves,
    almost_nothing,
];
