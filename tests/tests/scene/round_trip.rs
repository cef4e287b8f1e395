//! Shipped scenes are strict JSON, say what they show, and survive being written out.

use agglo_core::scene::{Problem, Scene};

use crate::shipped_scenes;

#[test]
fn shipped_scenes_are_right_and_say_what_they_show() {
    let scenes = shipped_scenes();
    assert!(scenes.len() >= 16, "{} scenes", scenes.len());
    for (name, text) in scenes {
        serde_json::from_str::<serde_json::Value>(&text).unwrap_or_else(|e| panic!("{name} is not strict JSON: {e}"));
        let scene = Scene::parse(&text, &[]).unwrap_or_else(|problems| panic!("{name}: {problems:?}"));
        assert!(scene.name.is_some_and(|n| !n.is_empty()), "{name} has no name");
        assert!(scene.description.is_some_and(|d| d.len() > 40), "{name} does not say what it shows");
    }
}

#[test]
fn a_scene_written_out_reads_back_equal() {
    for (name, text) in shipped_scenes() {
        let scene = Scene::parse(&text, &[]).unwrap();
        let written = scene.to_json();
        let read = Scene::parse(&written, &[]).unwrap_or_else(|problems| panic!("{name}: {problems:?}"));
        assert_eq!(read, scene, "{name}");
        assert_eq!(read.to_json(), written, "{name}");
    }
}

/// Doubles whose shortest decimal form is long, extreme, or negative zero keep every bit.
#[test]
fn every_bit_of_a_number_is_kept() {
    let values = [0.1 + 0.2, 1.0 / 3.0, f64::MIN_POSITIVE, 5e-324, 1e-310, 4503599627370497.5, -0.0, 1e22, f64::MAX];
    for value in values {
        let text = format!(
            r#"{{"duration": 1, "particles": {{"list": [{{"position": [{value:e}, 0, 0], "velocity": [0, {value:?}, 0],
            "radius": 1, "mass": 1}}]}}}}"#
        );
        let scene = Scene::parse(&text, &[]).unwrap();
        let read = Scene::parse(&scene.to_json(), &[]).unwrap();
        for scene in [scene, read] {
            let agglo_core::scene::ParticleSource::List(list) = &scene.particles else { panic!("a list") };
            assert_eq!(list[0].position[0].to_bits(), value.to_bits(), "{value:e}");
            assert_eq!(list[0].velocity[1].to_bits(), value.to_bits(), "{value:e}");
        }
    }
}

#[test]
fn comments_trailing_commas_and_a_schema_are_allowed() {
    let text = "\u{feff}// a comment\r\n{ /* one more */ \"$schema\": \"scene.schema.json\",\n\"duration\": 1e0, \"seed\": 1e3,
        \"particles\": { \"random_cube\": { \"count\": 2.0, \"side\": 1, \"radius\": 0.1, \"density\": 1, }, }, }\n";
    let scene = Scene::parse(text, &[]).unwrap();
    assert_eq!((scene.duration, scene.seed), (1.0, 1000));
    assert_eq!(Scene::parse(&scene.to_json(), &[]).unwrap(), scene);
}

/// A scene that was put together in memory is checked like one from a file.
#[test]
fn scenes_from_memory_are_checked() {
    let (_, text) = shipped_scenes().into_iter().find(|(name, _)| name == "clustering.json").unwrap();
    let good = Scene::parse(&text, &[]).unwrap();
    assert_eq!(good.validate(), []);
    let found = |change: &dyn Fn(&mut Scene)| -> Vec<Problem> {
        let mut scene = good.clone();
        change(&mut scene);
        scene.validate()
    };
    let cases = [
        (found(&|s| s.duration = -1.0), "/duration", "greater than 0"),
        (found(&|s| s.duration = f64::NAN), "/duration", "NaN or infinite"),
        (found(&|s| s.solver.step.max = Some(f64::INFINITY)), "/solver/step/max", "NaN or infinite"),
        (found(&|s| s.thermal = None), "/contact/restitution/theta_star", "thermal"),
    ];
    for (problems, pointer, part) in cases {
        assert_eq!(problems.len(), 1, "{problems:?}");
        assert_eq!(problems[0].pointer, pointer);
        assert!(problems[0].message.contains(part), "{}", problems[0]);
    }
}

/// A listed particle is checked wherever it stands in the list, and thousands of wrong ones do not flood the report.
#[test]
fn listed_particles_from_memory_are_checked() {
    use agglo_core::scene::{ListedParticle, ParticleSource};
    let text = r#"{"duration": 1, "particles": {"list": [{"position": [0, 0, 0], "radius": 0.1, "mass": 1}]}}"#;
    let good = Scene::parse(text, &[]).unwrap();
    let ParticleSource::List(list) = &good.particles else { panic!("a list") };
    let mut particles: Vec<ListedParticle> = vec![list[0].clone(); 5000];
    particles[4321].radius = -1.0;
    let problems = good.with_particles(ParticleSource::List(particles.clone())).validate();
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert_eq!(problems[0].pointer, "/particles/list/4321/radius");
    particles.iter_mut().for_each(|p| p.mass = Some(0.0));
    let problems = good.with_particles(ParticleSource::List(particles)).validate();
    assert_eq!(problems.len(), 101);
    assert_eq!(problems[100].message, "4901 more problems are not listed");
}

/// A hundred thousand unknown keys and as many wrong elements are refused in good time.
#[test]
fn huge_nonsense_is_refused_in_good_time() {
    let start = std::time::Instant::now();
    let keys: String = (0..100_000).map(|k| format!("\"key{k}\": {k}, ")).collect();
    let problems = Scene::parse(&format!("{{{keys}}}"), &[]).unwrap_err();
    assert!(problems.len() <= 101);
    let elements = "0,".repeat(100_000);
    let problems =
        Scene::parse(&format!("{{\"duration\": 1, \"particles\": {{\"list\": [{elements}]}}}}"), &[]).unwrap_err();
    assert_eq!(problems.len(), 101);
    // Either is well below a second; quadratic work would take minutes.
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}
