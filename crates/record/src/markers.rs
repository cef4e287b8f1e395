//! What viewers draw as solids: a sphere of true size per particle, the walls, the periodic box.

use agglo_core::scene::{Domain, Scene, Wall};
use agglo_core::state::{Particles, State};
use nalgebra::Vector3;

use crate::cloud::{FRAME_ID, identity};
use crate::convert::timestamp;
use crate::proto::foxglove::line_primitive::Type;
use crate::proto::foxglove::{
    self, Color, CubePrimitive, LinePrimitive, Point3, Pose, Quaternion, SceneEntity, SceneUpdate, SpherePrimitive,
};

/// Colour of walls and box.
const GREY: Color = Color { r: 0.6, g: 0.6, b: 0.65, a: 0.25 };

/// Builds the messages of `/scene`; keeps what does not change from one to the next.
#[derive(Clone, Debug)]
pub struct Markers {
    rate: f64,
    message: SceneUpdate,
    /// Number of the last interval of 1/rate of log time that has been drawn.
    drawn: Option<u64>,
}

impl Markers {
    /// Markers at `rate` Hz of log time; box and walls are drawn as large as the start asks for.
    pub fn new(scene: &Scene, rate: f64, particles: &Particles, start: &State) -> Self {
        let entities = entities(particles, start, scene.domain.as_ref());
        Self { rate, message: SceneUpdate { entities, ..SceneUpdate::default() }, drawn: None }
    }

    /// Whether a message is due: the first state after the start of every interval of 1/rate of log time.
    pub fn due(&mut self, log_time: u64) -> bool {
        let interval = (log_time as f64 * 1e-9 * self.rate).floor() as u64;
        let due = self.drawn.is_none_or(|drawn| interval > drawn);
        if due {
            self.drawn = Some(interval);
        }
        due
    }

    /// The message of a state.
    pub fn message(&mut self, (t, step, log_time): (f64, u64, u64), state: &State, colors: &[[u8; 4]]) -> &SceneUpdate {
        self.message.t = t;
        self.message.step = step;
        for entity in &mut self.message.entities {
            entity.timestamp = Some(timestamp(log_time));
            for (k, sphere) in entity.spheres.iter_mut().enumerate() {
                let [x, y, z] = <[f64; 3]>::from(state.position.get(k)).map(drawn);
                sphere.pose = Some(Pose { position: Some(foxglove::Vector3 { x, y, z }), ..identity() });
                sphere.color = Some(color(colors[k]));
            }
        }
        &self.message
    }
}

/// A coordinate to a hundred-thousandth of it: it is there to be looked at, and the state itself stands in `/particles`.
/// What is rounded away would fill a fifth of a log of 10 000 that are all drawn.
fn drawn(coordinate: f64) -> f64 {
    // Round to 16 bits of the mantissa; a carry goes into the exponent, as it should.
    const DROPPED: u64 = (1 << 36) - 1;
    f64::from_bits(coordinate.to_bits().wrapping_add(DROPPED / 2 + 1) & !DROPPED)
}

/// A colour in 64ths, which are short in binary and so compress, unlike 255ths.
fn color([r, g, b, a]: [u8; 4]) -> Color {
    let share = |channel| (f64::from(channel) * (64.0 / 255.0)).round() / 64.0;
    Color { r: share(r), g: share(g), b: share(b), a: share(a) }
}

fn entities(particles: &Particles, state: &State, domain: Option<&Domain>) -> Vec<SceneEntity> {
    let entity = |id: &str| SceneEntity { frame_id: FRAME_ID.to_owned(), id: id.to_owned(), ..SceneEntity::default() };
    let spheres = particles.radius.iter().map(|radius| {
        let diameter = 2.0 * radius;
        let size = foxglove::Vector3 { x: diameter, y: diameter, z: diameter };
        SpherePrimitive { pose: None, size: Some(size), color: None }
    });
    let mut entities = vec![SceneEntity { spheres: spheres.collect(), ..entity("particles") }];
    if let Some(Domain { periodic, walls }) = domain {
        let (low, high) = extent(particles, state);
        let lines = periodic.iter().map(|lengths| outline(lengths, low, high)).collect();
        let cubes = walls.iter().filter_map(|wall| slab(wall, low, high)).collect();
        entities.push(SceneEntity { lines, cubes, ..entity("domain") });
    }
    entities
}

/// The box around all particles.
fn extent(particles: &Particles, state: &State) -> (Vector3<f64>, Vector3<f64>) {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for (k, radius) in particles.radius.iter().enumerate() {
        let centre = state.position.get(k);
        low = low.inf(&centre.add_scalar(-radius));
        high = high.sup(&centre.add_scalar(*radius));
    }
    (low, high)
}

/// The periodic box as twelve lines; along open directions as long as the cloud at its start.
fn outline(lengths: &[Option<f64>; 3], low: Vector3<f64>, high: Vector3<f64>) -> LinePrimitive {
    let range: [(f64, f64); 3] =
        std::array::from_fn(|axis| lengths[axis].map_or((low[axis], high[axis]), |l| (0.0, l)));
    let corner = |bits: usize| {
        let [x, y, z] = std::array::from_fn(|axis| if bits >> axis & 1 == 0 { range[axis].0 } else { range[axis].1 });
        Point3 { x, y, z }
    };
    // An edge joins two corners that differ in one bit.
    let edges = (0..8_usize).flat_map(|from| (0..3).map(move |axis| (from, from | 1 << axis)));
    let points = edges.filter(|(from, to)| from != to).flat_map(|(from, to)| [corner(from), corner(to)]).collect();
    LinePrimitive {
        r#type: Type::LineList.into(),
        pose: Some(identity()),
        thickness: 1.5,
        scale_invariant: true,
        points,
        color: Some(Color { a: 1.0, ..GREY }),
        ..LinePrimitive::default()
    }
}

/// A wall as a thin slab behind its plane, twice as wide as the cloud at its start; a plane has no end.
fn slab(wall: &Wall, low: Vector3<f64>, high: Vector3<f64>) -> Option<CubePrimitive> {
    let normal = Vector3::from(wall.normal).try_normalize(0.0)?;
    let middle = (low + high) * 0.5;
    let width = 2.0 * (high - low).norm();
    let depth = 0.01 * width;
    let foot = middle - normal * (middle - Vector3::from(wall.point)).dot(&normal);
    let [x, y, z] = (foot - normal * (0.5 * depth)).into();
    Some(CubePrimitive {
        pose: Some(Pose { position: Some(foxglove::Vector3 { x, y, z }), orientation: Some(turn_from_z(normal)) }),
        size: Some(foxglove::Vector3 { x: width, y: width, z: depth }),
        color: Some(GREY),
    })
}

/// The shortest rotation that takes the z axis to a unit vector.
fn turn_from_z(to: Vector3<f64>) -> Quaternion {
    let [x, y, w] = [-to.y, to.x, 1.0 + to.z];
    let length = (x * x + y * y + w * w).sqrt();
    if length < 1e-9 {
        // Opposite to z: any axis in the plane will do.
        return Quaternion { x: 1.0, y: 0.0, z: 0.0, w: 0.0 };
    }
    Quaternion { x: x / length, y: y / length, z: 0.0, w: w / length }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_twelve_edges_and_a_wall_stands_on_its_plane() {
        let low = Vector3::new(0.0, 0.0, 1.0);
        let high = Vector3::new(1.0, 1.0, 3.0);
        let lines = outline(&[Some(2.0), Some(2.0), None], low, high);
        assert_eq!(lines.points.len(), 24);
        assert!(lines.points.iter().all(|p| (p.x == 0.0 || p.x == 2.0) && (p.z == 1.0 || p.z == 3.0)));

        let wall = Wall { point: [0.0, 0.0, 0.5], normal: [0.0, 0.0, 2.0] };
        let cube = slab(&wall, low, high).expect("a normal of length 2 is a direction");
        let centre = cube.pose.and_then(|pose| pose.position).expect("a pose");
        let depth = cube.size.expect("a size").z;
        // The face towards the particles lies in the plane; rounding only.
        assert!((centre.z + 0.5 * depth - 0.5).abs() < 1e-15);
    }

    #[test]
    fn what_is_drawn_is_a_hundred_thousandth_off_at_most() {
        for x in [0.0, 1.0, -1.0, 0.1, 3.0_f64.sqrt(), -1e-300, 1e300, 0.999_999_999, 2.0 - 1e-9] {
            // Half of the last of 16 bits.
            assert!((drawn(x) - x).abs() <= x.abs() * 0.5 / f64::from(1 << 16), "{x} is drawn at {}", drawn(x));
        }
        assert_eq!(drawn(2.0 - 1e-9), 2.0);
        let white = color([255; 4]);
        assert_eq!((white.r, white.a), (1.0, 1.0));
        // Half a 64th.
        assert!((color([77; 4]).g - 77.0 / 255.0).abs() <= 0.5 / 64.0);
    }

    #[test]
    fn the_turn_takes_z_to_the_normal() {
        for to in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, 0.0, -0.8]] {
            let Quaternion { x, y, z, w } = turn_from_z(to.into());
            // Third column of the rotation matrix of a unit quaternion.
            let turned = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
            for axis in 0..3 {
                // Six operations on numbers of order one.
                assert!((turned[axis] - to[axis]).abs() < 1e-15, "{to:?} became {turned:?}");
            }
        }
    }
}
