//! Spheres and lines to pixels: every sample of a pixel sees the nearest sphere or line, tile by tile.

use rayon::prelude::*;

use crate::camera::Camera;
use crate::canvas::{Canvas, distance};
use crate::occlusion::{Occlusion, Sphere};
use crate::rays::{Bounds, Rays};
use crate::shading::{Development, Light, mix, shade, veil};

/// Samples along each side of a pixel.
const SAMPLES: usize = 4;
/// Pixels along each side of a tile.
const TILE: usize = 32;
const SIDE: usize = TILE * SAMPLES;
/// Stands for nothing in a sample.
const NOTHING: u32 = u32::MAX;
/// Set in the numbers of lines.
const LINE: u32 = 1 << 31;
/// How much of a faded sphere is seen before the ground.
const FAINT: f32 = 0.18;
/// How much of it is seen before something else.
const FAINTER: f32 = 0.08;
/// Smallest radius drawn [pixels]: a sphere that is smaller would come and go between samples.
const LEAST: f64 = 0.5;

/// A sphere to draw.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Where it is.
    pub sphere: Sphere,
    /// Its colour.
    pub color: Light,
    /// Drawn as if made of thin glass: beside what is looked at.
    pub faded: bool,
}

/// A straight line to draw, hidden by what is in front of it.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Its ends, in the directions of the camera.
    pub ends: [[f64; 3]; 2],
    /// Its colour.
    pub color: Light,
    /// Its width [pixels].
    pub width: f64,
}

/// What one picture shows.
#[derive(Debug)]
pub struct Stage<'a> {
    /// The camera, of which spheres and lines know the directions already.
    pub camera: &'a Camera,
    /// The spheres, those first that are not faded.
    pub balls: &'a [Ball],
    /// The lines.
    pub lines: &'a [Line],
    /// Who darkens whom; numbers are those of `balls`. Faded ones cast no shade and take none.
    pub occlusion: &'a Occlusion,
    /// Colour behind everything.
    pub ground: Light,
    /// Distances between which haze grows from none to all of it [m].
    pub depths: [f64; 2],
    /// Share of the ground's colour that the farthest part of the cloud takes on [-].
    pub haze: f32,
}

/// Draws a stage on a canvas of its size.
pub fn paint(stage: &Stage<'_>, canvas: &mut Canvas) {
    let (width, height) = (canvas.width(), canvas.height());
    let balls: Vec<Ball> = stage.balls.par_iter().map(|ball| visible(ball, stage.camera)).collect();
    let bounds: Vec<Bounds> = balls.par_iter().map(|ball| Bounds::of(ball.sphere, stage.camera)).collect();
    let nearest = |i: &u32| balls[*i as usize].sphere.centre[2] - balls[*i as usize].sphere.radius;
    let mut order: Vec<u32> = (0..balls.len() as u32).filter(|&i| !bounds[i as usize].is_empty()).collect();
    order.par_sort_by(|a, b| nearest(a).total_cmp(&nearest(b)).then(a.cmp(b)));
    let lines: Vec<Trace> = (0..).zip(stage.lines).filter_map(|(k, line)| Trace::new(k, line, stage.camera)).collect();
    let development = Development::new();
    let scene = Scene { stage, balls: &balls, bounds: &bounds, lines: &lines, nearest: &nearest };
    let rows: Vec<(usize, &mut [u8])> = canvas.rows_mut(TILE).enumerate().collect();
    rows.into_par_iter().for_each(|(row, bytes)| {
        let (top, end) = (row * TILE, (row * TILE + TILE).min(height));
        let here: Vec<u32> = order.iter().copied().filter(|&i| bounds[i as usize].meets(1, top, end)).collect();
        let mut tile = Tile::new();
        for left in (0..width).step_by(TILE) {
            tile.draw(&scene, &here, [left, top]);
            for y in top..end {
                for x in left..(left + TILE).min(width) {
                    let color = development.color(tile.pixel(&scene, x, y));
                    let at = 3 * ((y - top) * width + x);
                    bytes[at..at + 3].copy_from_slice(&color);
                }
            }
        }
    });
}

/// The sphere, or one just large enough to be seen.
fn visible(ball: &Ball, camera: &Camera) -> Ball {
    let scale = if camera.perspective { camera.scale / ball.sphere.centre[2] } else { camera.scale };
    let least = if scale > 0.0 { LEAST / scale } else { 0.0 };
    Ball { sphere: Sphere { radius: ball.sphere.radius.max(least), ..ball.sphere }, ..*ball }
}

/// A line on the page.
struct Trace {
    number: u32,
    ends: [[f32; 2]; 2],
    /// 1/distance in perspective, which is even along the line there; else the distance.
    depths: [f64; 2],
    half: f32,
    bounds: Bounds,
}

impl Trace {
    fn new(number: u32, line: &Line, camera: &Camera) -> Option<Self> {
        let mut ends = line.ends;
        if camera.perspective {
            // The part in front of the eye.
            let near = 1e-3 * ends[0][2].max(ends[1][2]);
            if near <= 0.0 {
                return None;
            }
            for k in 0..2 {
                let (this, other) = (ends[k], ends[1 - k]);
                if this[2] < near {
                    let share = (near - this[2]) / (other[2] - this[2]);
                    ends[k] = [0, 1, 2].map(|c| this[c] + share * (other[c] - this[c]));
                }
            }
        }
        let pixels = ends.map(|end| camera.pixel(end));
        let half = 0.5 * line.width;
        let bounds = Bounds {
            low: [0, 1].map(|k| pixels[0][k].min(pixels[1][k]) - half),
            high: [0, 1].map(|k| pixels[0][k].max(pixels[1][k]) + half),
        };
        let depths = ends.map(|end| if camera.perspective { 1.0 / end[2] } else { end[2] });
        let ends = pixels.map(|pixel| pixel.map(|x| x as f32));
        ends.iter().flatten().all(|x| x.is_finite()).then_some(Self { number, ends, depths, half: half as f32, bounds })
    }

    /// Distance from the eye of the part of the line that covers a place on the page.
    fn depth(&self, place: [f32; 2], perspective: bool) -> Option<f32> {
        if distance(place, self.ends[0], self.ends[1]) > self.half {
            return None;
        }
        let along = [0, 1].map(|k| f64::from(self.ends[1][k]) - f64::from(self.ends[0][k]));
        let from = [0, 1].map(|k| f64::from(place[k]) - f64::from(self.ends[0][k]));
        let square = along[0] * along[0] + along[1] * along[1];
        let share =
            if square > 0.0 { ((along[0] * from[0] + along[1] * from[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
        let depth = self.depths[0] + share * (self.depths[1] - self.depths[0]);
        Some(if perspective { 1.0 / depth } else { depth } as f32)
    }
}

struct Scene<'a, N> {
    stage: &'a Stage<'a>,
    balls: &'a [Ball],
    bounds: &'a [Bounds],
    lines: &'a [Trace],
    nearest: &'a N,
}

/// The nearest thing at every sample of a tile.
struct Layer {
    depth: Vec<f32>,
    what: Vec<u32>,
    drawn: bool,
}

impl Layer {
    fn new() -> Self {
        Self { depth: vec![f32::INFINITY; SIDE * SIDE], what: vec![NOTHING; SIDE * SIDE], drawn: false }
    }

    fn clear(&mut self) {
        if self.drawn {
            self.depth.fill(f32::INFINITY);
            self.what.fill(NOTHING);
            self.drawn = false;
        }
    }

    fn put(&mut self, at: usize, depth: f32, what: u32) {
        if depth < self.depth[at] {
            (self.depth[at], self.what[at]) = (depth, what);
            self.drawn = true;
        }
    }

    fn farthest(&self) -> f64 {
        self.depth.iter().fold(0.0_f32, |farthest, &depth| farthest.max(depth)).into()
    }
}

struct Tile {
    corner: [usize; 2],
    solid: Layer,
    faded: Layer,
}

impl Tile {
    fn new() -> Self {
        Self { corner: [0; 2], solid: Layer::new(), faded: Layer::new() }
    }

    /// Finds what is nearest, of these spheres in the order of their nearest points, and of all lines.
    fn draw<N: Fn(&u32) -> f64>(&mut self, scene: &Scene<'_, N>, order: &[u32], corner: [usize; 2]) {
        self.corner = corner;
        self.solid.clear();
        self.faded.clear();
        let mut farthest = f64::INFINITY;
        let here = order.iter().filter(|&&i| scene.bounds[i as usize].meets(0, corner[0], corner[0] + TILE));
        for (count, i) in here.enumerate() {
            // What is behind everything in the tile need not be looked at; asked now and then, because it takes a while.
            if count % 32 == 31 {
                farthest = self.solid.farthest();
            }
            if (scene.nearest)(i) > farthest {
                break;
            }
            self.ball(scene.stage.camera, &scene.balls[*i as usize], *i, &scene.bounds[*i as usize]);
        }
        for line in scene.lines {
            self.line(line, scene.stage.camera.perspective);
        }
    }

    fn ball(&mut self, camera: &Camera, ball: &Ball, number: u32, bounds: &Bounds) {
        let layer = if ball.faded { &mut self.faded } else { &mut self.solid };
        let (columns, rows) = (samples(bounds, 0, self.corner[0]), samples(bounds, 1, self.corner[1]));
        let ray = Rays::new(camera, ball.sphere);
        let nearest = (ball.sphere.centre[2] - ball.sphere.radius) as f32;
        for row in rows {
            let y = sample(self.corner[1], row);
            for column in columns.clone() {
                // Most of what is behind is behind altogether.
                if layer.depth[row * SIDE + column] < nearest {
                    continue;
                }
                if let Some(depth) = ray.depth(sample(self.corner[0], column), y) {
                    layer.put(row * SIDE + column, depth as f32, number);
                }
            }
        }
    }

    fn line(&mut self, line: &Trace, perspective: bool) {
        for row in samples(&line.bounds, 1, self.corner[1]) {
            for column in samples(&line.bounds, 0, self.corner[0]) {
                let place = [sample(self.corner[0], column) as f32, sample(self.corner[1], row) as f32];
                if let Some(depth) = line.depth(place, perspective) {
                    self.solid.put(row * SIDE + column, depth, LINE | line.number);
                }
            }
        }
    }

    /// What all samples of a pixel see, where it is one thing and nothing is before it.
    fn alone(&self, x: usize, y: usize) -> Option<u32> {
        let first = (y - self.corner[1]) * SAMPLES * SIDE + (x - self.corner[0]) * SAMPLES;
        let what = self.solid.what[first];
        let rows = || (0..SAMPLES).map(|row| first + row * SIDE..first + row * SIDE + SAMPLES);
        let same = rows().all(|row| self.solid.what[row].iter().all(|&of| of == what));
        let free = || !self.faded.drawn || rows().all(|row| self.faded.what[row].iter().all(|&of| of == NOTHING));
        (same && free()).then_some(what)
    }

    /// The light of a pixel: every thing in it is shaded once, at the middle of the samples that see it.
    fn pixel<N>(&self, scene: &Scene<'_, N>, x: usize, y: usize) -> Light {
        let ground = scene.stage.ground;
        if !self.solid.drawn && !self.faded.drawn {
            return ground;
        }
        if let Some(what) = self.alone(x, y) {
            return scene.light(what, [x as f64 + 0.5, y as f64 + 0.5]);
        }
        // What is seen, and through what: how many samples, and the sum of their places.
        let mut seen = [([NOTHING; 2], 0_u32, [0_u32; 2]); SAMPLES * SAMPLES];
        let mut count = 0;
        let first = [(x - self.corner[0]) * SAMPLES, (y - self.corner[1]) * SAMPLES];
        for k in 0..SAMPLES * SAMPLES {
            let place = [k % SAMPLES, k / SAMPLES];
            let at = (first[1] + place[1]) * SIDE + first[0] + place[0];
            let through = if self.faded.depth[at] < self.solid.depth[at] { self.faded.what[at] } else { NOTHING };
            let what = [self.solid.what[at], through];
            let entry = match seen[..count].iter().position(|(of, ..)| *of == what) {
                Some(entry) => entry,
                None => {
                    seen[count].0 = what;
                    count += 1;
                    count - 1
                }
            };
            seen[entry].1 += 1;
            seen[entry].2[0] += place[0] as u32;
            seen[entry].2[1] += place[1] as u32;
        }
        let mut sum = [0.0; 3];
        for ([what, through], samples, places) in &seen[..count] {
            let middle = |k: usize, pixel: usize| {
                pixel as f64 + (f64::from(places[k]) / f64::from(*samples) + 0.5) / SAMPLES as f64
            };
            let place = [middle(0, x), middle(1, y)];
            let mut light = scene.light(*what, place);
            if *through != NOTHING {
                let faint = if *what == NOTHING { FAINT } else { FAINTER };
                light = mix(light, scene.light(*through, place), faint);
            }
            let share = *samples as f32 / (SAMPLES * SAMPLES) as f32;
            sum = [0, 1, 2].map(|k| sum[k] + share * light[k]);
        }
        sum
    }
}

impl<N> Scene<'_, N> {
    /// The light of one thing at a place on the page.
    fn light(&self, what: u32, place: [f64; 2]) -> Light {
        let stage = self.stage;
        if what == NOTHING {
            return stage.ground;
        }
        if what & LINE != 0 {
            return stage.lines.get((what ^ LINE) as usize).map_or(stage.ground, |line| line.color);
        }
        let ball = &self.balls[what as usize];
        let rays = Rays::new(stage.camera, ball.sphere);
        let (depth, direction) = rays.nearest(place[0], place[1]);
        let Sphere { centre, radius } = ball.sphere;
        let point = if stage.camera.perspective {
            direction.map(|d| d * depth)
        } else {
            let offset = rays.offset(place[0], place[1]);
            [offset[0] + centre[0], offset[1] + centre[1], depth]
        };
        let normal = [0, 1, 2].map(|k| (point[k] - centre[k]) / radius);
        let length = (direction[0] * direction[0] + direction[1] * direction[1] + 1.0).sqrt();
        let to_eye = direction.map(|d| (-d / length) as f32);
        let open = if ball.faded { 1.0 } else { stage.occlusion.open(what as usize, point, normal) };
        let light = shade(ball.color, normal.map(|n| n as f32), to_eye, open);
        let [near, far] = stage.depths;
        let away = if far > near { ((depth - near) / (far - near)).clamp(0.0, 1.0) as f32 } else { 0.0 };
        veil(light, stage.ground, stage.haze * away)
    }
}

/// Numbers of the samples of a tile that begins at this pixel which may be inside.
fn samples(bounds: &Bounds, k: usize, from: usize) -> std::ops::Range<usize> {
    let sample = |pixel: f64| ((pixel - from as f64) * SAMPLES as f64).clamp(0.0, SIDE as f64);
    sample(bounds.low[k]).floor() as usize..sample(bounds.high[k]).ceil() as usize
}

/// Place of a sample of a tile that begins at a pixel [pixels].
fn sample(corner: usize, number: usize) -> f64 {
    corner as f64 + (number as f64 + 0.5) / SAMPLES as f64
}

#[cfg(test)]
mod tests;
