//! What can be chosen about a picture.

/// All that can be chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Which states; none: the last one, of animations a hundred evenly spaced in time.
    pub at: Vec<When>,
    /// What the file is to be.
    pub format: Format,
    /// Width and height of the whole picture [pixels].
    pub size: Option<[u32; 2]>,
    /// Pictures side by side on a sheet.
    pub columns: Option<u32>,
    /// What colours stand for; `None`: temperature where there is one, else charge, else speed.
    pub color: Option<Quantity>,
    /// Values at the ends of the colour bar [K, m/s, C].
    pub range: Option<[f64; 2]>,
    /// Where the cloud is seen from.
    pub view: View,
    /// How many times larger than fitted, or than a given camera shows it [-].
    pub zoom: f64,
    /// How many times larger than they are spheres are drawn [-].
    pub magnified: f64,
    /// Parallel instead of central projection.
    pub orthographic: bool,
    /// A fitted camera stands still even where a cloud in free space drifts.
    pub still: bool,
    /// Look at one cluster, all else faded.
    pub cluster: Option<ClusterChoice>,
    /// Pictures of an animation per second [1/s].
    pub frames_per_second: f64,
    /// Dark instead of light ground.
    pub dark: bool,
    /// Name of the scene on top.
    pub title: bool,
    /// Colour bar below.
    pub legend: bool,
    /// A PNG of 256 colours: about a third of the bytes.
    pub indexed: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            at: Vec::new(),
            format: Format::Png,
            size: None,
            columns: None,
            color: None,
            range: None,
            view: View::default(),
            zoom: 1.0,
            magnified: 1.0,
            orthographic: false,
            still: false,
            cluster: None,
            frames_per_second: 25.0,
            dark: false,
            title: true,
            legend: true,
            indexed: false,
        }
    }
}

/// Which states are shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum When {
    /// The last one at or before this time [s].
    Time(f64),
    /// The last one.
    End,
    /// All of them.
    All,
    /// The last one at or before every multiple of this time [s].
    Every(f64),
    /// The last ones at or before so many times, evenly spaced from the first state to the last.
    Frames(u32),
}

impl std::str::FromStr for When {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.parse::<f64>().ok().filter(|t| t.is_finite());
        match (text, text.strip_prefix("every:")) {
            ("end", _) => Ok(Self::End),
            ("all", _) => Ok(Self::All),
            (_, Some(spacing)) => match number(spacing) {
                Some(spacing) if spacing > 0.0 => Ok(Self::Every(spacing)),
                _ => Err(format!("{spacing:?} is not a time in seconds above zero")),
            },
            _ => number(text)
                .map(Self::Time)
                .ok_or_else(|| format!("{text:?} is not a time in seconds, `end`, `all` or `every:SECONDS`")),
        }
    }
}

/// Formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// One picture, a sheet where there are several moments.
    Png,
    /// An animation in all colours.
    Apng,
    /// An animation in 256 colours.
    Gif,
}

/// What colours stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Temperature [K].
    Temperature,
    /// Speed [m/s].
    Speed,
    /// Cluster; single particles are grey.
    Cluster,
    /// Charge [C].
    Charge,
    /// Nothing.
    None,
}

/// Where a cloud is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// From a direction, at the distance at which all is seen.
    From {
        /// Angle of the direction about z, from x to y [degrees].
        azimuth: f64,
        /// Angle of the direction above the plane of x and y [degrees].
        elevation: f64,
    },
    /// From a point towards another [m].
    Placed {
        /// The camera.
        eye: [f64; 3],
        /// What is in the middle of the picture.
        target: [f64; 3],
    },
}

impl Default for View {
    /// From the side of negative y, where x goes right and z up, a little from the right and above: all three axes show.
    fn default() -> Self {
        Self::From { azimuth: -65.0, elevation: 20.0 }
    }
}

/// A cluster to look at, as it is at the last moment shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClusterChoice {
    /// The one with most particles.
    Largest,
    /// The one of this number, as the states of the log count them.
    Number(u32),
}

impl std::str::FromStr for ClusterChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "largest" => Ok(Self::Largest),
            _ => text.parse().map(Self::Number).map_err(|_| format!("{text:?} is not a cluster's number or `largest`")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_clusters_are_read_or_refused() {
        assert_eq!("0.5".parse(), Ok(When::Time(0.5)));
        assert_eq!("end".parse(), Ok(When::End));
        assert_eq!("all".parse(), Ok(When::All));
        assert_eq!("every:1e-3".parse(), Ok(When::Every(1e-3)));
        for wrong in ["", "nan", "every:0", "every:-1", "every:", "every:inf", "last"] {
            assert!(wrong.parse::<When>().is_err(), "{wrong}");
        }
        assert_eq!("largest".parse(), Ok(ClusterChoice::Largest));
        assert_eq!("7".parse(), Ok(ClusterChoice::Number(7)));
        assert!("-7".parse::<ClusterChoice>().is_err() && "".parse::<ClusterChoice>().is_err());
    }
}
