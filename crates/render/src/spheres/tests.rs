//! Pictures of spheres against geometry: extents, order of depth, and a reference that asks every sphere at every sample.

use nalgebra::Vector3;

use super::*;
use crate::canvas::Rgb;
use crate::shading::light;

const GROUND: Rgb = [0xf3, 0xf4, 0xf7];

/// Numbers in 0..1 from a linear congruential generator (Knuth's MMIX constants).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A camera whose directions are those of the world, so that places are what they are called: right, up, forward.
fn camera(perspective: bool, scale: f64, size: [usize; 2]) -> Camera {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    Camera { eye: Vector3::zeros(), axes, perspective, scale, centre: size.map(|side| 0.5 * side as f64) }
}

fn ball(centre: [f64; 3], radius: f64, color: Rgb) -> Ball {
    Ball { sphere: Sphere { centre, radius }, color: light(color), faded: false }
}

fn picture(camera: &Camera, balls: &[Ball], lines: &[Line], size: [usize; 2]) -> Canvas {
    let spheres = balls.iter().filter(|ball| !ball.faded).map(|ball| ball.sphere).collect();
    let occlusion = Occlusion::new(spheres);
    let stage =
        Stage { camera, balls, lines, occlusion: &occlusion, ground: light(GROUND), depths: [1.0, 9.0], haze: 0.1 };
    let mut canvas = Canvas::new(size[0], size[1], GROUND);
    paint(&stage, &mut canvas);
    canvas
}

/// First and last column and row that are not the ground's.
fn extent(canvas: &Canvas) -> [[usize; 2]; 2] {
    let mut ends = [[usize::MAX, 0]; 2];
    for (k, pixel) in canvas.bytes().chunks_exact(3).enumerate() {
        if pixel != GROUND {
            for (end, at) in ends.iter_mut().zip([k % canvas.width(), k / canvas.width()]) {
                *end = [end[0].min(at), end[1].max(at)];
            }
        }
    }
    ends
}

#[test]
fn spheres_are_where_and_as_large_as_geometry_says() {
    let size = [200, 160];
    // Side by side rays: place and size do not depend on the distance.
    let canvas = picture(&camera(false, 50.0, size), &[ball([0.6, -0.4, 5.0], 0.7, [90, 20, 20])], &[], size);
    let [[left, right], [top, bottom]] = extent(&canvas);
    // 100 + 50 (0.6 -+ 0.7) and 80 + 50 (0.4 -+ 0.7); the last pixel is the one that the edge is in.
    assert_eq!([left, right, top, bottom], [95, 164, 65, 134]);
    // In perspective the edges are tangents from the eye, a little outside the projected radius.
    let (centre, radius) = ([0.9_f64, 0.0, 5.0_f64], 0.7_f64);
    let canvas = picture(&camera(true, 250.0, size), &[ball(centre, radius, [90, 20, 20])], &[], size);
    let [[left, right], [top, bottom]] = extent(&canvas);
    let (along, half) = (centre[0].atan2(centre[2]), (radius / centre[0].hypot(centre[2])).asin());
    let edges = [along - half, along + half].map(|angle| 100.0 + 250.0 * angle.tan());
    let height = 250.0 * radius / (centre[2] * centre[2] - radius * radius).sqrt();
    for (found, expected) in [
        (left as f64, edges[0]),
        (right as f64 + 1.0, edges[1]),
        (top as f64, 80.0 - height),
        (bottom as f64 + 1.0, 80.0 + height),
    ] {
        // To a pixel: a pixel is touched where any of its samples is.
        assert!((found - expected).abs() <= 1.0, "{found} instead of {expected}");
    }
}

#[test]
fn the_nearer_sphere_hides_the_farther_one_and_half_an_edge_is_half_a_colour() {
    let size = [80, 60];
    let (red, blue) = ([200, 0, 0], [0, 0, 200]);
    for order in [[0, 1], [1, 0]] {
        let balls = [ball([0.0, 0.0, 6.0], 1.0, red), ball([0.3, 0.0, 3.0], 0.5, blue)];
        let canvas = picture(&camera(false, 20.0, size), &order.map(|k| balls[k]), &[], size);
        let [r, _, b] = canvas.pixel(46, 30);
        assert!(b > 100 && r < 90, "the small one is in front of the large one");
        let [r, _, b] = canvas.pixel(30, 30);
        assert!(r > 100 && b < 90, "beside it the large one is seen");
    }
    // An edge through the middle of a pixel: a mixture of both sides in linear light, neither one.
    let canvas = picture(&camera(false, 20.0, size), &[ball([0.025, 0.0, 3.0], 1.0, [0; 3])], &[], size);
    let [edge, inside, outside] = [60, 59, 61].map(|x| canvas.pixel(x, 30)[1]);
    assert!(edge > inside + 60 && edge + 25 < outside, "{inside} {edge} {outside}");
}

#[test]
fn spheres_that_reach_into_each_other_meet_in_a_plane() {
    let size = [80, 60];
    let balls = [ball([-0.3, 0.0, 5.0], 0.7, [200, 0, 0]), ball([0.3, 0.0, 5.0], 0.7, [0, 0, 200])];
    let canvas = picture(&camera(false, 30.0, size), &balls, &[], size);
    for y in 12..48 {
        let ([left, _, _], [_, _, right]) = (canvas.pixel(38, y), canvas.pixel(41, y));
        assert!(left > 60 && right > 60, "row {y}");
    }
}

#[test]
fn lines_are_hidden_by_what_is_in_front_of_them_only() {
    let size = [60, 60];
    let sphere = ball([0.0, 0.0, 5.0], 1.0, [0, 150, 0]);
    for perspective in [false, true] {
        let camera = camera(perspective, if perspective { 75.0 } else { 15.0 }, size);
        let across = |depth: f64| {
            // As long on the page at any distance.
            let reach = if perspective { 0.3 * depth } else { 1.5 };
            Line { ends: [[-reach, 0.0, depth], [reach, 0.0, depth]], color: light([200, 0, 0]), width: 3.0 }
        };
        let at = |depth: f64, x: usize| picture(&camera, &[sphere], &[across(depth)], size).pixel(x, 30);
        assert!(at(3.0, 30)[0] > 190 && at(3.0, 11)[0] > 190);
        assert!(at(7.0, 30)[0] < 90 && at(7.0, 11)[0] > 190);
    }
}

#[test]
fn a_sphere_around_or_behind_the_eye_is_not_drawn() {
    let size = [40, 40];
    for balls in [[ball([0.0, 0.0, 1.0], 3.0, [0; 3])], [ball([0.0, 0.0, -5.0], 1.0, [0; 3])]] {
        assert_eq!(picture(&camera(true, 40.0, size), &balls, &[], size), Canvas::new(40, 40, GROUND));
    }
}

#[test]
fn a_sphere_smaller_than_a_sample_is_still_seen() {
    let size = [40, 40];
    for k in 0..10 {
        let place = 0.037 * f64::from(k);
        let canvas = picture(&camera(false, 10.0, size), &[ball([place, place, 5.0], 1e-9, [0; 3])], &[], size);
        let dark: f64 = canvas.bytes().chunks_exact(3).map(|pixel| f64::from(GROUND[1].saturating_sub(pixel[1]))).sum();
        assert!(dark > 60.0, "at {place}: {dark}");
    }
}

#[test]
fn what_is_faded_is_seen_through() {
    let size = [60, 60];
    let faded = Ball { faded: true, ..ball([0.0, 0.0, 3.0], 1.0, [0, 0, 200]) };
    let canvas = picture(&camera(false, 20.0, size), &[ball([0.5, 0.0, 6.0], 0.4, [200, 0, 0]), faded], &[], size);
    let ([r, _, b], [_, g, _]) = (canvas.pixel(40, 30), canvas.pixel(15, 30));
    assert!(r > 140 && b < 110, "what is behind it: {r} {b}");
    assert!((150..244).contains(&g), "the ground behind it: {g}");
}

/// What a ray sees, by asking every sphere: its number and the distance along the ray.
fn nearest(balls: &[Ball], origin: Vector3<f64>, ray: Vector3<f64>) -> Option<(usize, f64)> {
    let hits = balls.iter().enumerate().filter_map(|(i, ball)| {
        let to = Vector3::from(ball.sphere.centre) - origin;
        let along = to.dot(&ray);
        let off = (to - ray * along).norm();
        let reach = along - (ball.sphere.radius.powi(2) - off * off).max(0.0).sqrt();
        (off <= ball.sphere.radius && reach > 0.0).then_some((i, reach))
    });
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// A pixel as the rules say: sixteen samples; what they see is shaded once each, at the mean place of its samples.
fn reference(stage: &Stage<'_>, balls: &[Ball], [px, py]: [usize; 2]) -> Light {
    let camera = stage.camera;
    let ray = |x: f64, y: f64| {
        let [x, y] = [(x - camera.centre[0]) / camera.scale, (camera.centre[1] - y) / camera.scale];
        if camera.perspective {
            (Vector3::zeros(), Vector3::new(x, y, 1.0).normalize())
        } else {
            (Vector3::new(x, y, 0.0), Vector3::z())
        }
    };
    let mut seen: std::collections::BTreeMap<Option<usize>, Vec<[f64; 2]>> = std::collections::BTreeMap::new();
    for k in 0..16 {
        let place = [px as f64 + (f64::from(k % 4) + 0.5) / 4.0, py as f64 + (f64::from(k / 4) + 0.5) / 4.0];
        let (origin, direction) = ray(place[0], place[1]);
        seen.entry(nearest(balls, origin, direction).map(|(i, _)| i)).or_default().push(place);
    }
    let mut sum = [0.0_f32; 3];
    for (what, places) in seen {
        let share = places.len() as f32 / 16.0;
        let middle = [0, 1].map(|k| places.iter().map(|place| place[k]).sum::<f64>() / places.len() as f64);
        let color = match what {
            None => stage.ground,
            Some(i) => {
                let (origin, direction) = ray(middle[0], middle[1]);
                let Sphere { centre, radius } = balls[i].sphere;
                let to = Vector3::from(centre) - origin;
                let along = to.dot(&direction);
                let off = (to - direction * along).norm();
                let point = origin + direction * (along - (radius * radius - off * off).max(0.0).sqrt());
                let normal: [f64; 3] = ((point - Vector3::from(centre)) / radius).into();
                let open = stage.occlusion.open(i, point.into(), normal);
                let shaded = shade(balls[i].color, normal.map(|n| n as f32), direction.map(|d| -d as f32).into(), open);
                let away = ((point.z - stage.depths[0]) / (stage.depths[1] - stage.depths[0])).clamp(0.0, 1.0) as f32;
                veil(shaded, stage.ground, stage.haze * away)
            }
        };
        sum = [0, 1, 2].map(|k| sum[k] + share * color[k]);
    }
    sum
}

#[test]
fn pictures_are_those_of_a_reference_that_asks_every_sphere() {
    let size = [90, 70];
    let development = Development::new();
    for (seed, perspective) in [(1, false), (2, true), (3, true), (4, false)] {
        let mut random = Random(seed);
        let mut within = |low: f64, high: f64| low + (high - low) * random.next();
        let balls: Vec<Ball> = (0..60)
            .map(|_| {
                // Radii from 1 to 1/1000, most of them small, and centres beyond the page and behind each other.
                let centre = [within(-2.5, 2.5), within(-2.0, 2.0), within(3.0, 9.0)];
                let color = [(); 3].map(|()| within(0.0, 255.0) as u8);
                ball(centre, 10_f64.powf(within(-3.0, 0.0)), color)
            })
            .collect();
        let camera = camera(perspective, if perspective { 100.0 } else { 20.0 }, size);
        let occlusion = Occlusion::new(balls.iter().map(|ball| ball.sphere).collect());
        let stage = Stage {
            camera: &camera,
            balls: &balls,
            lines: &[],
            occlusion: &occlusion,
            ground: light(GROUND),
            depths: [2.0, 9.0],
            haze: 0.2,
        };
        let mut canvas = Canvas::new(size[0], size[1], GROUND);
        paint(&stage, &mut canvas);
        // What is too small to be seen is drawn with a radius of half a pixel.
        let drawn: Vec<Ball> = balls.iter().map(|ball| visible(ball, &camera)).collect();
        for y in 0..size[1] {
            for x in 0..size[0] {
                let (found, expected) = (canvas.pixel(x, y), development.color(reference(&stage, &drawn, [x, y])));
                // One byte: sums in another order.
                let same = found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1);
                assert!(same, "seed {seed}, pixel {x}, {y}: {found:?} instead of {expected:?}");
            }
        }
    }
}

#[test]
fn the_number_of_threads_does_not_change_a_picture() {
    let mut random = Random(9);
    let balls: Vec<Ball> = (0..3000)
        .map(|_| {
            let centre = [(); 3].map(|()| random.next());
            ball([centre[0], centre[1], centre[2] + 3.0], 0.02 * random.next(), [120, 130, 140])
        })
        .collect();
    let size = [300, 200];
    let camera = Camera { centre: [90.0, 160.0], ..camera(true, 370.0, size) };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| picture(&camera, &balls, &[], size))
    };
    let one = on(1);
    assert!(one != Canvas::new(300, 200, GROUND));
    assert!(on(2) == one && on(5) == one);
}
