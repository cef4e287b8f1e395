//! The viewer layout of every shipped scene: its panels are those of the effects, and what they show is in the log.

use std::collections::BTreeSet;
use std::path::Path;

use agglo_core::Scene;
use agglo_record::channels::{Effects, by_name, present};
use agglo_record::layout::{FULL, layout};
use prost::Message;
use prost_types::FileDescriptorSet;
use serde_json::Value;

fn shipped() -> Vec<(String, Scene)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files
        .map(|path| {
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            (name, Scene::parse(&std::fs::read_to_string(&path).unwrap(), &[]).unwrap())
        })
        .collect()
}

fn parsed(scene: &Scene) -> Value {
    serde_json::from_str(&layout(scene)).unwrap()
}

/// Panels in the tree.
fn placed(tree: &Value, found: &mut BTreeSet<String>) {
    match tree {
        Value::String(panel) => assert!(found.insert(panel.clone()), "{panel} stands twice"),
        split => ["first", "second"].iter().for_each(|part| placed(&split[part], found)),
    }
}

/// Topics and fields that a panel shows, such as `/energy.kinetic`.
fn shown(panel: &Value) -> Vec<String> {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let mut paths: Vec<String> = ["topicPath", "topicToRender"].iter().filter_map(|key| text(&panel[*key])).collect();
    paths.extend(panel["paths"].as_array().into_iter().flatten().filter_map(|path| text(&path["value"])));
    let topics = panel["topics"].as_object().into_iter().flatten();
    paths.extend(topics.filter(|(_, how)| how["visible"] == true).map(|(topic, _)| topic.clone()));
    paths
}

#[test]
fn every_panel_shows_what_is_in_the_log() {
    let full: Value = serde_json::from_str(FULL).unwrap();
    let layouts = shipped().into_iter().map(|(name, scene)| {
        let effects = Effects::of(&scene).unwrap();
        (name, parsed(&scene), present(&effects).map(|channel| channel.name).collect::<Vec<_>>())
    });
    let all = agglo_record::channels::CHANNELS.iter().map(|channel| channel.name).collect();
    for (name, layout, channels) in layouts.chain([("full".to_owned(), full.clone(), all)]) {
        let mut panels = BTreeSet::new();
        placed(&layout["layout"], &mut panels);
        let configured: BTreeSet<String> = layout["configById"].as_object().unwrap().keys().cloned().collect();
        assert_eq!(panels, configured, "{name}");
        for path in layout["configById"].as_object().unwrap().values().flat_map(shown) {
            let (topic, field) = path.split_once('.').unwrap_or((&path, ""));
            assert!(channels.contains(&topic), "{name}: {path} is in no log of this scene");
            let channel = by_name(topic).unwrap();
            let set = FileDescriptorSet::decode(channel.descriptor).unwrap();
            let message = channel.schema.rsplit_once('.').unwrap().1;
            let found = set.file.iter().flat_map(|file| &file.message_type).find(|m| m.name() == message).unwrap();
            assert!(field.is_empty() || found.field.iter().any(|f| f.name() == field), "{name}: there is no {path}");
        }
    }
}

#[test]
fn variants_fit_their_scenes() {
    for (name, scene) in shipped() {
        let layout = parsed(&scene);
        let has = |panel: &str| layout["configById"].get(panel).is_some();
        assert_eq!(has("Plot!temperature"), scene.thermal.is_some(), "{name}");
        assert_eq!(has("Plot!clusters"), scene.binding.is_some() || scene.clusters.is_some(), "{name}");
        assert_eq!(has("Table!impacts"), scene.contact.is_some(), "{name}");
        let always = ["Plot!kinetic", "Plot!dt", "Plot!iterations", "Plot!residual", "RosOut!log"];
        assert!(always.into_iter().all(has) && has("RawMessages!diagnostics") && has("3D!spheres"), "{name}");
        let cloud = &layout["configById"]["3D!points"]["topics"]["/particles"];
        let title = layout["configById"]["3D!spheres"]["foxglovePanelTitle"].as_str().unwrap();
        let charged = Effects::of(&scene).unwrap().charge;
        let (mode, word) = match (scene.thermal.is_some(), charged) {
            (true, _) => ("colormap", "temperature"),
            (false, true) => ("rgba-fields", "charge"),
            (false, false) => ("rgba-fields", "speed"),
        };
        assert_eq!(cloud["colorMode"], mode, "{name}");
        assert!(title.contains(word), "{name}: {title}");
    }
}

#[test]
fn the_colour_scale_is_that_of_the_scene() {
    let scene = |temperature: f64, coefficient: f64| {
        let text = format!(
            r#"{{"duration": 1.0, "particles": {{"random_cube": {{"count": 8, "side": 1.0, "radius": 0.1,
                "density": 1000.0, "temperature": {temperature:?}}}}},
                "thermal": {{"heat_capacity": 1000.0,
                    "convection": {{"coefficient": {coefficient:?}, "ambient": 290.0}}}}}}"#
        );
        Scene::parse(&text, &[]).unwrap()
    };
    let cloud = |layout: &Value| layout["configById"]["3D!points"]["topics"]["/particles"].clone();
    let layout = parsed(&scene(350.0, 1.0));
    assert_eq!((cloud(&layout)["minValue"].as_f64(), cloud(&layout)["maxValue"].as_f64()), (Some(290.0), Some(350.0)));
    let title = &layout["configById"]["3D!spheres"]["foxglovePanelTitle"];
    assert_eq!(title, "Particles, true sizes: temperature, 290 K blue to 350 K red");
}

#[test]
fn large_clouds_are_points_coloured_by_a_column() {
    let text = r#"{"duration": 1.0, "particles": {"random_cube": {"count": 1000000, "side": 1.0, "radius_ratio": 0.1,
        "density": 1000.0, "velocity_mean": [1.0, 0, 0], "velocity_spread": [2.0, 2.0, 2.0]}}}"#;
    let layout = parsed(&Scene::parse(text, &[]).unwrap());
    assert!(layout["configById"].get("3D!spheres").is_none());
    let cloud = &layout["configById"]["3D!points"]["topics"]["/particles"];
    assert_eq!((cloud["colorField"].as_str(), cloud["maxValue"].as_f64()), (Some("vx"), Some(3.0)));
}

#[test]
fn the_camera_sees_the_way_of_a_drifting_cloud() {
    let (_, scene) = shipped().into_iter().find(|(name, _)| name == "clustering").unwrap();
    let layout = parsed(&scene);
    let camera = &layout["configById"]["3D!spheres"]["cameraState"];
    // It starts in the unit cube and drifts with 1 m/s along x for 5 s; radii are equal.
    assert!((camera["target"][0].as_f64().unwrap() - 3.0).abs() < 1e-12, "{camera}");
    assert!(camera["distance"].as_f64().unwrap() > 5.0, "{camera}");
}
