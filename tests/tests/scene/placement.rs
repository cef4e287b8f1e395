//! Where particles start: the same bits from the same seed, no overlap, nothing that was not asked for.

use agglo_core::placement::{Stream, place};
use agglo_core::scene::{Scene, Setting};
use agglo_core::state::{Particles, State};

use crate::shipped_scenes;

fn scene(text: &str, settings: &[&str]) -> Scene {
    let settings: Vec<Setting> = settings.iter().map(|s| Setting::parse(s).unwrap()).collect();
    Scene::parse(text, &settings).unwrap_or_else(|problems| panic!("{problems:?}"))
}

fn shipped(name: &str, settings: &[&str]) -> Scene {
    let (_, text) = shipped_scenes().into_iter().find(|(file, _)| file == name).unwrap();
    scene(&text, settings)
}

fn cube(settings: &[&str]) -> Scene {
    let text =
        r#"{"duration": 1, "particles": {"random_cube": {"count": 1000, "side": 1, "radius": 0.03, "density": 2}}}"#;
    scene(text, settings)
}

/// Smallest distance of two centres over their diameter, looking at every pair.
fn closest(particles: &Particles, state: &State, lengths: [f64; 3]) -> f64 {
    let r = &state.position;
    let mut least = f64::INFINITY;
    for i in 0..r.len() {
        for j in i + 1..r.len() {
            let d = r.get(i) - r.get(j);
            let squared: f64 = (0..3)
                .map(|k| if lengths[k] > 0.0 { d[k] - lengths[k] * (d[k] / lengths[k]).round() } else { d[k] })
                .map(|d| d * d)
                .sum();
            least = least.min(squared.sqrt() / (particles.radius[i] + particles.radius[j]));
        }
    }
    least
}

#[test]
fn every_shipped_scene_can_be_placed() {
    for (name, text) in shipped_scenes() {
        let scene = scene(&text, &[]);
        let (particles, state) = place(&scene).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(particles.len(), state.position.len(), "{name}");
        assert_eq!(particles.len(), state.velocity.len(), "{name}");
        assert_eq!(state.temperature.is_some(), scene.thermal.is_some(), "{name}");
        assert!(particles.mass.iter().all(|m| *m > 0.0), "{name}");
    }
}

/// The same places for one seed, others for another; and they do not change from one version to the next.
#[test]
fn places_depend_on_the_seed_alone() {
    let (a, b) = (place(&cube(&["seed=7"])).unwrap(), place(&cube(&["seed=7"])).unwrap());
    assert_eq!(a, b);
    assert_ne!(a.1.position, place(&cube(&["seed=8"])).unwrap().1.position);
    // Particle 0 meets nobody: its velocity is draws 1 to 3 of its stream, its position draws 4 to 6.
    let mut stream = Stream::new(7, 0);
    let draws: Vec<f64> = (0..6).map(|_| stream.uniform()).collect();
    assert_eq!(a.1.position.get(0).as_slice(), &draws[3..]);
    let moving = place(&cube(&[
        "seed=7",
        "particles.random_cube.velocity_mean=[3, 0, 0]",
        "particles.random_cube.velocity_spread=[0.5, 0.25, 0]",
    ]))
    .unwrap();
    assert_eq!(moving.1.position, a.1.position, "velocities must not shift the positions' draws");
    let v = moving.1.velocity.get(0);
    assert_eq!(v.as_slice(), &[3.0 + 0.5 * (2.0 * draws[0] - 1.0), 0.25 * (2.0 * draws[1] - 1.0), 0.0]);
}

/// Adding particles leaves those before them where they were.
#[test]
fn a_longer_cloud_begins_like_a_shorter_one() {
    let (short, long) = (place(&cube(&[])).unwrap(), place(&cube(&["particles.random_cube.count=1200"])).unwrap());
    assert_eq!(short.1.position.x[..], long.1.position.x[..1000]);
}

#[test]
fn spheres_do_not_overlap_in_open_and_periodic_cubes() {
    for (settings, lengths) in [
        (vec![], [0.0; 3]),
        (vec!["domain.periodic=[1,1,1]"], [1.0; 3]),
        (vec!["domain.periodic=[1,null,1.01]"], [1.0, 0.0, 1.01]),
        // A box smaller than the cube: places are wrapped into it.
        (vec!["domain.periodic=[0.9,null,null]"], [0.9, 0.0, 0.0]),
        // Two cells and one cell along an axis.
        (
            vec!["particles.random_cube.count=3", "particles.random_cube.radius=0.24", "domain.periodic=[1,1,1]"],
            [1.0; 3],
        ),
        (vec!["particles.random_cube.count=2", "particles.random_cube.radius=0.3"], [0.0; 3]),
    ] {
        let (particles, state) = place(&cube(&settings)).unwrap();
        let closest = closest(&particles, &state, lengths);
        assert!(closest >= 1.0, "{settings:?}: {closest}");
        for (axis, column) in state.position.axes().into_iter().enumerate() {
            let end = if lengths[axis] > 0.0 { lengths[axis] } else { 1.0 };
            assert!(column.iter().all(|x| (0.0..=end).contains(x)), "{settings:?}");
        }
    }
}

#[test]
fn walls_keep_spheres_inside() {
    let walls = r#"domain.walls=[{"point":[0,0,0.2],"normal":[0,0,5]},{"point":[1,1,1],"normal":[-1,-1,0]}]"#;
    let (particles, state) =
        place(&cube(&["contact.restitution=0.5", walls, "particles.random_cube.count=500"])).unwrap();
    for i in 0..particles.len() {
        let r = state.position.get(i);
        assert!(r.z - 0.2 >= particles.radius[i]);
        // The distance is computed with a unit normal here and with a normalised one there: round-off apart.
        assert!((2.0 - r.x - r.y) / 2f64.sqrt() >= particles.radius[i] * (1.0 - 1e-14));
    }
}

/// A cube near the densest random placement is filled, one beyond it refused, both quickly.
#[test]
fn dense_cubes_are_filled_or_refused() {
    let radius_for = |share: f64| (share / 1000.0 * 3.0 / (4.0 * std::f64::consts::PI)).cbrt();
    let periodic = "domain.periodic=[1,1,1]";
    let (particles, _) =
        place(&cube(&[periodic, &format!("particles.random_cube.radius={}", radius_for(0.30))])).unwrap();
    assert_eq!(particles.len(), 1000);
    for (share, part) in [(0.45, "no free place was found for particle"), (0.80, "at their densest")] {
        let error =
            place(&cube(&[periodic, &format!("particles.random_cube.radius={}", radius_for(share))])).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(part), "{message}");
        assert!(message.contains(&format!("{:.1} %", 100.0 * share)), "{message}");
        assert_eq!(error.problems[0].pointer, "/particles/random_cube");
    }
}

/// Time and memory grow like the number of spheres; the bound is generous for slow machines.
#[test]
fn a_million_spheres_are_placed_in_seconds() {
    let start = std::time::Instant::now();
    let scene = cube(&["particles.random_cube.count=1000000", "particles.random_cube.radius=0.003"]);
    let (particles, _) = place(&scene).unwrap();
    assert_eq!(particles.len(), 1_000_000);
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}

#[test]
fn charges_are_dealt_in_turn_and_only_where_named() {
    assert_eq!(place(&cube(&[])).unwrap().0.charge, None);
    let (particles, _) = place(&cube(&["particles.random_cube.charge=[1,-2,0]"])).unwrap();
    assert_eq!(particles.charge.unwrap()[..5], [1.0, -2.0, 0.0, 1.0, -2.0]);
    let (particles, _) = place(&cube(&["particles.random_cube.charge=-3"])).unwrap();
    assert!(particles.charge.unwrap().iter().all(|q| *q == -3.0));
    let text = r#"{"duration": 1, "particles": {"list": [
        {"position": [0, 0, 0], "radius": 1, "mass": 2, "charge": 5, "temperature": 300},
        {"position": [2, 0, 0], "radius": 1, "density": 3}]}}"#;
    let (particles, state) = place(&scene(text, &[])).unwrap();
    assert_eq!(particles.charge, Some(vec![5.0, 0.0]));
    assert_eq!(state.temperature, None, "temperatures without `thermal` have no column");
    assert_eq!(particles.mass[0], 2.0);
    // The closed form of the volume, to round-off.
    assert!((particles.mass[1] / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-15);
}

#[test]
fn the_papers_sphere_has_the_papers_size() {
    let (particles, _) = place(&shipped("clustering.json", &[])).unwrap();
    // b = 0.25/100^(1/3) = 0.0539 m, and m = 2000 (4/3) pi b^3 = 1.309 kg.
    assert!((particles.radius[0] - 0.053_860_867).abs() < 1e-9, "{}", particles.radius[0]);
    assert!((particles.mass[0] - 1.308_997).abs() < 1e-6, "{}", particles.mass[0]);
}

#[test]
fn positions_outside_a_periodic_box_are_wrapped() {
    let text = r#"{"duration": 1, "domain": {"periodic": [1, null, 2]}, "particles": {"list": [
        {"position": [-0.25, -7, 5], "radius": 0.1, "mass": 1}, {"position": [1, 0, 0], "radius": 0.1, "mass": 1}]}}"#;
    let (_, state) = place(&scene(text, &[])).unwrap();
    assert_eq!(state.position.get(0).as_slice(), &[0.75, -7.0, 1.0]);
    assert_eq!(state.position.get(1).as_slice(), &[0.0, 0.0, 0.0]);
}
