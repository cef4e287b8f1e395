//! Arguments of `agglo render`.

use std::path::PathBuf;

use agglo_render::options::{ClusterChoice, When};
use clap::{Args, ValueEnum};

use crate::target::Target;

/// Arguments of `agglo render`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  agglo render clustering.mcap -o end.png
  agglo render clustering.mcap --frames 8 -o moments.png
  agglo render clustering.mcap --cluster largest -o cluster.png
  agglo render clustering.mcap -o clustering.gif")]
pub struct RenderArgs {
    /// Log file
    pub log: PathBuf,
    /// Which states: a time in seconds (the last state at or before it), `end`, `all`, or `every:SECONDS`; may be given
    /// several times [default: end]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub at: Vec<When>,
    /// So many moments, evenly spaced from the first state to the last [default of animations: 100]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000), conflicts_with = "at")]
    pub frames: Option<u32>,
    /// File to write; `-` writes to standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Target,
    /// Replace a file that exists
    #[arg(long)]
    pub overwrite: bool,
    /// Format to write [default: by the ending of FILE]
    #[arg(long, value_enum)]
    pub format: Option<RenderFormat>,
    /// Width and height of the whole picture in pixels, such as 1200x900
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Moments side by side on a sheet
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub columns: Option<u32>,
    /// What colours stand for [default: temperature where there is one, else charge, else speed]
    #[arg(long = "color-by", visible_alias = "colour-by", value_name = "QUANTITY", value_enum)]
    pub color_by: Option<Quantity>,
    /// Values at the ends of the colour bar, in SI units, such as 300..400
    #[arg(long, value_name = "LOW..HIGH", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<[f64; 2]>,
    /// Direction from which the cloud is seen, in degrees: from x towards y, and up; -90,0 has x right and z up
    /// [default: -65,20]
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub view: Option<[f64; 2]>,
    /// Place of the camera in metres, in place of one that is fitted to all that is shown
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true, requires = "target")]
    #[arg(conflicts_with = "view")]
    pub camera: Option<[f64; 3]>,
    /// What the camera looks at, in metres
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true, requires = "camera")]
    pub target: Option<[f64; 3]>,
    /// How many times larger than fitted, or than the camera shows at an angle of 30 degrees
    #[arg(long, value_name = "F", default_value_t = 1.0, allow_negative_numbers = true)]
    pub zoom: f64,
    /// Draw spheres so many times as large as they are, and say so in the title
    #[arg(long, value_name = "F", default_value_t = 1.0, allow_negative_numbers = true)]
    pub magnify: f64,
    /// Parallel projection: spheres of one size look alike at any distance
    #[arg(long)]
    pub orthographic: bool,
    /// Let the camera stand still; without it, it goes along with a cloud that is in no box and has no walls
    #[arg(long)]
    pub still: bool,
    /// Look at the `largest` cluster of the last moment, or at that of a number, all else faded
    #[arg(long, value_name = "CLUSTER")]
    pub cluster: Option<ClusterChoice>,
    /// Pictures of an animation per second
    #[arg(long, value_name = "N", default_value_t = 25.0)]
    pub fps: f64,
    /// Ground of the picture
    #[arg(long, value_enum, default_value_t)]
    pub background: Background,
    /// Leave out the name of the scene
    #[arg(long)]
    pub no_title: bool,
    /// Leave out the colour bar
    #[arg(long)]
    pub no_legend: bool,
    /// Write a PNG of 256 colours: about a third of the bytes
    #[arg(long)]
    pub indexed: bool,
}

/// Formats of `agglo render`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RenderFormat {
    /// One picture, or a sheet of several moments.
    Png,
    /// An animation in all colours.
    Apng,
    /// An animation in 256 colours.
    Gif,
}

/// What colours can stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Quantity {
    /// Temperature.
    Temperature,
    /// Speed.
    Speed,
    /// Cluster; single particles are grey.
    Cluster,
    /// Charge.
    Charge,
    /// Nothing.
    None,
}

/// Grounds of pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Background {
    /// White and light grey.
    #[default]
    Light,
    /// Nearly black.
    Dark,
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', '×']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides.ok_or_else(|| "a size is WIDTHxHEIGHT in pixels, such as 1200x900".to_owned())
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let ends: Option<[f64; 2]> =
        text.split_once("..").and_then(|(low, high)| Some([low.parse().ok()?, high.parse().ok()?]));
    match ends {
        Some([low, high]) if low < high && (high - low).is_finite() => Ok([low, high]),
        _ => Err("a range is LOW..HIGH with LOW below HIGH, such as 300..400".to_owned()),
    }
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| format!("{N} numbers with commas between them are needed"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_ranges_and_places_are_read_or_refused() {
        assert_eq!(size("1200x900"), Ok([1200, 900]));
        assert!(["", "1200", "1200x", "-1x5", "1e3x5"].iter().all(|wrong| size(wrong).is_err()));
        assert_eq!(range("-1..2.5e3"), Ok([-1.0, 2500.0]));
        assert!(["", "1..", "2..1", "1..1", "nan..1", "0..inf"].iter().all(|wrong| range(wrong).is_err()));
        assert_eq!(numbers("1, -2,3e1"), Ok([1.0, -2.0, 30.0]));
        assert!(["1,2", "1,2,3,4", "1,2,nan", ""].iter().all(|wrong| numbers::<3>(wrong).is_err()));
    }
}
