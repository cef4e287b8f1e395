//! agglo's pictures: shaded spheres of true size, from the states of logs.
//!
//! [`draw`] reads a log and writes a picture of one moment, a sheet of several, or an animation. The same log and
//! options give the same bytes on any number of threads.
//!
//! | module | holds |
//! |---|---|
//! | [`options`] | what can be chosen |
//! | `moments` | which states of the log are shown |
//! | `survey` | what all of them have in common: extent, values, times |
//! | `camera` | where it is seen from, and the fit of a camera to a cloud |
//! | `artist`, `book` | one moment as a picture, and all of them on pages |
//! | `spheres`, `rays`, `shading`, `occlusion` | depth, light and shade of spheres and lines |
//! | `colors` | from temperature, speed, charge, cluster to colours |
//! | `sheet`, `legend`, `canvas`, `text`, `quantity` | the page around the spheres |
//! | `encode` | PNG, APNG, GIF |

mod artist;
mod book;
mod camera;
mod canvas;
mod clusters;
mod colors;
mod domain;
mod draw;
mod encode;
mod error;
mod legend;
mod moments;
mod occlusion;
pub mod options;
mod quantity;
mod rays;
mod shading;
mod sheet;
mod spheres;
mod survey;
mod text;

pub use draw::{Drawn, draw};
pub use error::RenderError;
pub use options::Options;
