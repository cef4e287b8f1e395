//! `render`: pictures looked at pixel by pixel, and what is refused.

use super::planted::Parts;
use super::{CLOUD, Folder, PAIR, shipped};

const GROUND: [u8; 3] = [0xf3, 0xf4, 0xf7];

/// A decoded picture.
struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    fn of(bytes: &[u8]) -> Self {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        assert_eq!(info.color_type, png::ColorType::Rgb);
        let pixels = data.chunks_exact(3).map(|pixel| pixel.try_into().unwrap()).collect();
        Self { width: info.width as usize, height: info.height as usize, pixels }
    }

    fn at(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }

    /// The part of the picture that is neither ground nor grey, [-].
    fn colored(&self) -> f64 {
        let colored = |[r, g, b]: &&[u8; 3]| r.max(g).max(b) - r.min(g).min(b) > 30;
        self.pixels.iter().filter(colored).count() as f64 / self.pixels.len() as f64
    }
}

/// A folder with `scene.mcap`.
fn recorded(scene: &str) -> Folder {
    let folder = Folder::with(scene);
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    folder
}

/// A small picture of `scene.mcap`.
fn bytes(folder: &Folder, arguments: &[&str]) -> Vec<u8> {
    let all = [&["render", "scene.mcap", "-o", "-", "--size", "320x240"][..], arguments].concat();
    folder.agglo(&all).code(0).stdout
}

fn picture(folder: &Folder, arguments: &[&str]) -> Picture {
    Picture::of(&bytes(folder, arguments))
}

/// Everything but the spheres left out, seen along y in parallel: x to the right, z up.
const PLAIN: [&str; 5] = ["--no-title", "--no-legend", "--orthographic", "--view", "-90,0"];

#[test]
fn spheres_are_where_the_states_say() {
    let folder = recorded(PAIR);
    let all = [&["render", "scene.mcap", "-o", "-", "--size", "600x300", "--at", "0"][..], &PLAIN].concat();
    let picture = Picture::of(&folder.agglo(&all).code(0).stdout);
    assert_eq!((picture.width, picture.height), (600, 300));
    // The cloud, 0.7 m from edge to edge, fills 92 % of the width within the margin of 10 pixels or so.
    let row = &picture.pixels[150 * 600..151 * 600];
    let spheres: Vec<usize> = (20..580).filter(|&x| row[x] != GROUND).collect();
    let gap = spheres.windows(2).position(|pair| pair[1] > pair[0] + 1).unwrap();
    let ends = [spheres[0], spheres[gap] + 1, spheres[gap + 1], spheres[spheres.len() - 1] + 1];
    let metre = (ends[3] - ends[0]) as f64 / 0.7;
    for (end, place) in ends.into_iter().zip([0.0, 0.1, 0.6, 0.7]) {
        let expected = ends[0] as f64 + metre * place;
        assert!((end as f64 - expected).abs() <= 1.5, "{ends:?}: {end} instead of {expected}");
    }
    assert!((0.90..0.94).contains(&((ends[3] - ends[0]) as f64 / 586.0)), "{ends:?}");
    assert_eq!(ends[0] + ends[3], 600, "in the middle");
}

#[test]
fn scenes_show_temperature_else_charge_else_speed() {
    let folder = recorded(CLOUD);
    assert!(picture(&folder, &[]).colored() > 0.05);
    assert_eq!(bytes(&folder, &[]), bytes(&folder, &["--color-by", "temperature"]));
    let pictures = ["temperature", "speed", "cluster", "none"].map(|by| bytes(&folder, &["--color-by", by]));
    assert!((1..4).all(|k| pictures[..k].iter().all(|other| *other != pictures[k])));
    folder
        .agglo(&["render", "scene.mcap", "-o", "x.png", "--color-by", "charge"])
        .code(2)
        .says(&["no charges to colour by", "speed, temperature, cluster"]);
    assert_eq!(bytes(&recorded(PAIR), &[]), bytes(&recorded(PAIR), &["--color-by", "speed"]));

    let folder = Folder::new();
    let scene = shipped("charged-cloud");
    let short = ["--set", "duration=0.002", "--set", "record.interval=0.001", "-o", "scene.mcap", "-q"];
    folder.agglo(&[&["run", scene.to_str().unwrap()][..], &short].concat()).code(0);
    assert_eq!(bytes(&folder, &[]), bytes(&folder, &["--color-by", "charge"]));
    // Charges of both signs: blue ones and red ones.
    let picture = picture(&folder, &["--no-legend", "--zoom", "2"]);
    let count =
        |such: fn(i32) -> bool| picture.pixels.iter().filter(|[r, _, b]| such(i32::from(*r) - i32::from(*b))).count();
    assert!(count(|redder| redder > 60) > 100 && count(|redder| redder < -60) > 100);
}

#[test]
fn a_sphere_in_the_light_has_the_colour_of_the_bar() {
    let sphere = |temperature: f64| {
        format!(
            r#"{{ "duration": 1e-3, "particles": {{ "list": [
            {{ "position": [0, 0, 0], "radius": 1, "mass": 1, "temperature": {temperature} }} ] }},
            "thermal": {{ "heat_capacity": 1000 }} }}"#
        )
    };
    for (temperature, color) in [(300.0, [0x0d, 0x08, 0x87]), (350.0, [0xc2, 0x3d, 0x7f]), (400.0, [0xf4, 0xd8, 0x24])]
    {
        let folder = recorded(&sphere(temperature));
        let picture = picture(&folder, &[&PLAIN[..], &["--range", "300..400"]].concat());
        let middle = picture.at(160, 120);
        // To a tenth of the range of bytes: shading and gloss.
        assert!(middle.iter().zip(color).all(|(a, b)| a.abs_diff(b) < 26), "{temperature} K: {middle:?}");
    }
}

#[test]
fn moments_are_beside_each_other_with_one_camera_and_one_scale() {
    let folder = recorded(CLOUD);
    let sheet = |more: &[&str]| {
        let all =
            [&["render", "scene.mcap", "-o", "-", "--size", "800x400", "--no-title", "--no-legend"][..], more].concat();
        Picture::of(&folder.agglo(&all).code(0).stdout)
    };
    let eight = sheet(&["--frames", "8"]);
    // Eight cells of four columns: white between them, ground in their corners.
    let cells = |y: usize| {
        let ground: Vec<bool> = (0..800).map(|x| eight.at(x, y) != [0xff; 3]).collect();
        ground.windows(2).filter(|pair| !pair[0] && pair[1]).count()
    };
    assert_eq!([cells(20), cells(380)], [4, 4]);
    // The same state twice is the same picture twice, and others beside it change neither camera nor colours there.
    let (pair, more) = (sheet(&["--at", "0", "--at", "0.1"]), sheet(&["--at", "0.1", "--at", "0"]));
    assert!(pair.pixels == more.pixels, "the order of wishes does not matter");
    let steps = sheet(&["--at", "every:0.05"]);
    let times = sheet(&["--at", "0", "--at", "0.05", "--at", "end"]);
    let frames = sheet(&["--frames", "3"]);
    assert!(steps.pixels == times.pixels && frames.pixels == times.pixels);
    // More moments than there are states are as many as there are.
    folder.agglo(&["render", "scene.mcap", "-o", "x.png", "--frames", "100000"]).code(0);
    folder
        .agglo(&["render", "scene.mcap", "-o", "y.png", "--at", "all", "--size", "64x64"])
        .code(2)
        .says(&["101 pictures"]);
    folder.agglo(&["render", "scene.mcap", "-o", "z.png", "--at", "7"]).code(0).says(&["ends at t = 0.1 s"]);
    folder.agglo(&["render", "scene.mcap", "-o", "w.png", "--at", "-1"]).code(2).says(&["-1", "first"]);
    assert_eq!(folder.files(), ["scene.json", "scene.mcap", "x.png", "z.png"]);
}

#[test]
fn animations_have_a_picture_for_every_moment() {
    let folder = recorded(CLOUD);
    let run = |arguments: &[&str]| {
        folder.agglo(&[&["render", "scene.mcap", "--size", "160x120"][..], arguments].concat()).code(0);
    };
    run(&["-o", "x.gif", "--frames", "6", "--fps", "10"]);
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let gif = folder.read("x.gif");
    let mut decoder = options.read_info(&gif[..]).unwrap();
    assert_eq!((decoder.width(), decoder.height()), (160, 120));
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        delays.push(frame.delay);
    }
    assert_eq!(delays, [10; 6]);
    run(&["-o", "x.apng", "--at", "all"]);
    let reader = png::Decoder::new(std::io::Cursor::new(folder.read("x.apng"))).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 101);
    // Of few states each is shown for all the moments that it stands for.
    folder.agglo(&["run", "scene.json", "--set", "record.every_steps=50", "-o", "few.mcap", "-q"]).code(0);
    folder.agglo(&["render", "few.mcap", "--size", "160x120", "--frames", "9", "--fps", "20", "-o", "few.gif"]).code(0);
    let gif = folder.read("few.gif");
    let mut decoder = gif::DecodeOptions::new().read_info(&gif[..]).unwrap();
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        delays.push(frame.delay);
    }
    assert_eq!(delays, [20, 20, 5]);
}

#[test]
fn pictures_are_the_same_bytes_on_any_number_of_threads() {
    let folder = recorded(CLOUD);
    for arguments in
        [&["--frames", "3"][..], &["--frames", "4", "--format", "gif"], &["--indexed"], &["--cluster", "largest"]]
    {
        let on = |threads: &str| bytes(&folder, &[arguments, &["--threads", threads]].concat());
        let one = on("1");
        assert!(on("2") == one && on("5") == one, "{arguments:?}");
    }
}

#[test]
fn hard_scenes_are_drawn() {
    let list = |more: &str, particles: &str| {
        recorded(&format!(
            r#"{{ "duration": 2e-3, "particles": {{ "list": [{particles}] }}, "solver": {{ "step": {{ "fixed": 1e-3 }} }} {more} }}"#
        ))
    };
    let one = r#"{ "position": [1, 2, 3], "radius": 0.1, "mass": 1 }"#;
    assert!(picture(&list("", one), &[]).colored() > 0.2, "one sphere fills the picture");
    // Radii of 1 to 1/1000: the small one is seen.
    let folder = list(
        "",
        r#"{ "position": [0, 0, 0], "radius": 1, "mass": 1 }, { "position": [0, 0, 1.2], "radius": 1e-3, "mass": 1 }"#,
    );
    let tiny = picture(&folder, &PLAIN);
    let rows: Vec<usize> = (0..240).filter(|&y| (0..320).any(|x| tiny.at(x, y)[1] < 200)).collect();
    assert!(rows[0] + 5 < rows[rows.len() / 20 + 3], "a speck above the sphere: {rows:?}");
    // Walls and boxes are lines around what moves in them.
    let wall = r#", "contact": { "restitution": 0.5 }, "domain": { "walls": [{ "point": [0, 0, 2.8], "normal": [0, 0, 1] }] }"#;
    let periodic = r#", "domain": { "periodic": [2, 3, 4] }"#;
    for domain in [wall, periodic] {
        let folder = list(domain, one);
        assert!(bytes(&folder, &[]) != bytes(&list("", one), &[]), "{domain}");
        let lines = picture(&folder, &["--no-legend"]).pixels.iter().filter(|p| p[0].abs_diff(0x9a) < 8).count();
        assert!(lines > 50, "{domain}: {lines}");
    }
    // A cluster across the faces of a periodic box is one piece.
    let clusters = r#", "clusters": { "range": 1.5 }"#;
    let pair = |x: f64| {
        format!(
            r#"{{ "position": [{x}, 2, 3], "radius": 0.1, "mass": 1 }}, {{ "position": [1.9, 2, 3], "radius": 0.1, "mass": 1 }}"#
        )
    };
    let across = list(&format!("{clusters}{periodic}"), &pair(0.1));
    let inside = list(clusters, &pair(2.1));
    let zoom = |folder| bytes(folder, &[&PLAIN[..], &["--cluster", "largest"]].concat());
    assert!(Picture::of(&zoom(&across)).colored() > 0.1);
    assert_eq!(Picture::of(&zoom(&across)).colored(), Picture::of(&zoom(&inside)).colored());
    // No cluster to look at.
    let apart = list(clusters, one);
    apart.agglo(&["render", "scene.mcap", "-o", "x.png", "--cluster", "largest"]).code(2).says(&["no cluster of two"]);
    assert!(picture(&apart, &["--color-by", "cluster"]).colored() < 0.05, "single particles are grey");
    apart.agglo(&["render", "scene.mcap", "-o", "x.png", "--cluster", "9"]).code(2).says(&["no cluster"]);
    list("", one).agglo(&["render", "scene.mcap", "-o", "x.png", "--cluster", "0"]).code(2).says(&["no clusters"]);
}

#[test]
fn a_camera_is_where_it_is_put() {
    let folder = recorded(PAIR);
    let camera = ["--camera", "0,-3,0", "--target", "0,0,0", "--no-title", "--no-legend", "--at", "0"];
    let straight = picture(&folder, &camera);
    assert!(straight.at(160, 120) != GROUND, "it looks at the first sphere");
    let right = (200..320).find(|&x| straight.at(x, 120) != GROUND).unwrap();
    // The second is 0.6 m to the right at 3 m; 15 degrees are half the height of 226 pixels within the margin.
    let expected = 160.0 + 0.5 * 226.0 / 0.268 * 0.55 / 3.0;
    assert!((right as f64 - expected).abs() < 3.0, "{right} instead of {expected}");
    let zoomed = picture(&folder, &[&camera[..], &["--zoom", "3"]].concat());
    assert!(zoomed.colored() > 5.0 * straight.colored() * 0.5);
    folder.agglo(&["render", "scene.mcap", "-o", "x.png", "--camera", "0,0,0"]).code(2).says(&["--target"]);
    let same = ["render", "scene.mcap", "-o", "x.png", "--camera", "0,0,0", "--target", "0,0,0"];
    folder.agglo(&same).code(2).says(&["sees nothing"]);
    let dark = picture(&folder, &["--background", "dark", "--no-title", "--no-legend"]);
    assert!(dark.at(20, 220).iter().all(|&byte| byte < 40));
    let large = picture(&folder, &["--magnify", "3", "--no-title", "--no-legend"]);
    assert!(large.colored() > 3.0 * picture(&folder, &["--no-title", "--no-legend"]).colored());
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let folder = recorded(PAIR);
    folder.write("x.png", "precious");
    folder.agglo(&["render", "scene.mcap", "-o", "x.png"]).code(2).says(&["x.png exists", "--overwrite"]);
    assert_eq!(folder.read("x.png"), b"precious");
    folder.agglo(&["render", "scene.mcap", "-o", "x.png", "--overwrite"]).code(0);
    assert!(Picture::of(&folder.read("x.png")).colored() > 0.0);
    let log = folder.read("scene.mcap");
    folder.agglo(&["render", "scene.mcap", "-o", "scene.mcap", "--format", "png", "--overwrite"]).code(2);
    assert_eq!(folder.read("scene.mcap"), log);
    for (name, says) in [("x.jpg", ".png, .apng or .gif"), ("x", "--format"), ("nowhere/x.png", "nowhere")] {
        folder.agglo(&["render", "scene.mcap", "-o", name]).code(2).says(&[says]);
    }
    for arguments in [
        &["--at", "later"][..],
        &["--at", "nan"],
        &["--at", "every:0"],
        &["--frames", "0"],
        &["--frames", "3", "--at", "0"],
        &["--size", "10x10"],
        &["--size", "9000x100"],
        &["--size", "100"],
        &["--zoom", "0"],
        &["--zoom", "nan"],
        &["--magnify", "-1"],
        &["--fps", "0"],
        &["--range", "5..1"],
        &["--view", "1"],
        &["--columns", "0"],
        &["--color-by", "taste"],
    ] {
        let ran = folder.agglo(&[&["render", "scene.mcap", "-o", "y.png"][..], arguments].concat()).code(2);
        assert!(!ran.stderr.is_empty(), "{arguments:?}");
    }
    for log in ["missing.mcap", "scene.json", "."] {
        folder.agglo(&["render", log, "-o", "y.png"]).code(2).says(&[log]);
    }
    assert_eq!(folder.files(), ["scene.json", "scene.mcap", "x.png"]);
}

#[test]
fn of_a_damaged_log_what_is_whole_is_drawn() {
    let folder = recorded(CLOUD);
    let whole = folder.read("scene.mcap");
    let render = |name: &str, more: &[&str]| {
        folder.agglo(&[&["render", name, "-o", "x.png", "--overwrite", "--size", "320x240"][..], more].concat())
    };
    folder.write("cut.mcap", &whole[..whole.len() * 2 / 3]);
    for arguments in [&[][..], &["--frames", "4"], &["--at", "all", "--format", "gif"]] {
        render("cut.mcap", arguments).code(3).says(&["damaged"]);
        assert!(folder.read("x.png").len() > 1000, "{arguments:?}");
    }
    // A flipped bit anywhere in a log of several chunks: a picture of the rest and a warning, or an error; never silence.
    folder.agglo(&["run", "scene.json", "--set", "duration=0.5", "-o", "long.mcap", "-q"]).code(0);
    let whole = folder.read("long.mcap");
    let mut codes = [0; 4];
    for k in 1..24 {
        let mut flipped = whole.clone();
        flipped[whole.len() * k / 24] ^= 1;
        folder.write("flipped.mcap", &flipped);
        let code = render("flipped.mcap", &["--at", "every:0.05"]).code;
        let code = code.filter(|code| [2, 3].contains(code)).unwrap_or_else(|| panic!("byte {k}/24: {code:?}"));
        codes[code as usize] += 1;
    }
    assert!(codes[3] >= 12, "{codes:?}");
}

#[test]
fn particles_without_a_place_are_missing_and_missed() {
    let folder = recorded(CLOUD);
    let mut parts = Parts::of(&folder.read("scene.mcap"));
    parts.number(100, 7, 0, |_| f64::NAN);
    parts.number(100, 8, 2, |_| f64::INFINITY);
    parts.number(100, 9, 6, |_| f64::NAN);
    folder.write("nan.mcap", parts.write());
    folder
        .agglo(&["render", "nan.mcap", "-o", "x.png"])
        .code(0)
        .says(&["2 particles without a finite place", "1 particle whose value is no number drawn in white"]);
    let picture = Picture::of(&folder.read("x.png"));
    assert!(picture.colored() > 0.05);
    for particle in 0..100 {
        parts.number(100, particle, 1, |_| f64::NAN);
    }
    folder.write("lost.mcap", parts.write());
    folder.agglo(&["render", "lost.mcap", "-o", "y.png"]).code(2).says(&["no particle has a position"]);
}
