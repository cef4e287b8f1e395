//! From a log to a picture: what is shown, how far it reaches, and then moment by moment.

use std::io::{Read, Seek, Write};

use agglo_core::scene::{Domain, Scene};
use agglo_core::state::Particles;
use agglo_record::palette::Shown as Usual;
use agglo_replay::{Damage, Frame, Log, LogError};

use crate::artist::{Artist, BAR_STEPS};
use crate::book::Book;
use crate::camera::axes;
use crate::canvas::Canvas;
use crate::clusters::groups;
use crate::domain::{self, Segment};
use crate::error::RenderError;
use crate::legend::{self, Bar};
use crate::moments::{self, Moments, Passed};
use crate::options::{ClusterChoice, Format, Options, Quantity, View, When};
use crate::quantity::Clock;
use crate::sheet::{self, Corners, Layout, Theme};
use crate::survey::{Subject, Survey, suggested};
use crate::text::Text;

/// Pictures of an animation where nothing is said about its moments.
const MOMENTS: u32 = 100;

/// What was drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Moments shown.
    pub moments: usize,
    /// A time asked for, and the time of the log's last state, which was drawn instead [s].
    pub ends_before: Option<(f64, f64)>,
    /// Whether the camera went along with what it shows.
    pub followed: bool,
    /// Particles that have no finite position or radius and are missing.
    pub lost: usize,
    /// Particles whose temperature, speed or charge is no number; they are white.
    pub valueless: usize,
    /// Parts of the log that could not be read.
    pub damage: Vec<Damage>,
}

/// Draws moments of a log as the options say. `watch` hears how many moments are done, of how many (0 until that is
/// known), and says whether to go on.
///
/// # Errors
/// A log that cannot be read or holds no state at a time asked for, options that do not fit the log, an output that
/// refuses bytes; [`RenderError::Stopped`] where `watch` says so.
pub fn draw<R: Read + Seek, W: Write>(
    log: &mut Log<R>,
    options: &Options,
    out: W,
    watch: &mut dyn FnMut(usize, usize) -> bool,
) -> Result<Drawn, RenderError> {
    check(options)?;
    let mut particles = log.particles()?;
    let mut moments = Moments::new(log, &wishes(options))?;
    let shown = match ends(log, &moments, &particles, watch) {
        Err(RenderError::Log(LogError::Damaged(_))) => {
            moments.read_all();
            ends(log, &moments, &particles, watch)?
        }
        other => other?,
    };
    let quantity = quantity(options, &particles, &shown.last)?;
    let (scene, scene_lost) = scene(log)?;
    let subject = subject(options, &shown.last, scene.as_ref())?;
    let cells = if options.format == Format::Png { shown.count } else { 1 };
    let layout = Layout::new(options, cells, options.legend && legend::has(quantity))?;
    let Some(cell) = layout.cells.first().copied() else {
        return Err(RenderError::asked("there is no moment to draw", "choose one with --at"));
    };
    let suggested = match (&scene, quantity) {
        (Some(scene), Quantity::Temperature) => {
            suggested(scene, &particles, &moments::first(log)?.unwrap_or(shown.first))
        }
        _ => None,
    };
    particles.radius.iter_mut().for_each(|radius| *radius *= options.magnified);

    let size = [cell.width, cell.height];
    let mut survey = Survey::new(&particles, &subject, quantity, (axes(options.view)?, size));
    let passed = moments.each(log, &particles, |frame, _| {
        survey.add(frame);
        if watch(0, shown.count) { Ok(()) } else { Err(RenderError::Stopped) }
    })?;
    let segments = domain_lines(scene.as_ref(), &subject, &mut survey);
    let (camera, depths) = survey.camera(options, size)?;
    let (scale, beyond) = survey.scale(options, suggested);
    let artist = Artist {
        particles: &particles,
        subject: &subject,
        quantity,
        scale,
        camera,
        depths,
        segments,
        clock: Clock::new(&survey.times),
        theme: Theme::new(options.dark),
        text: Text::new(),
        em: layout.em,
        size,
    };
    let few = options.format == Format::Gif || options.indexed;
    let page = page(&artist, &layout, &title(log, options, &subject), (beyond, few));
    let (count, indexed) = (shown.count, options.indexed);
    Book { moments: &moments, layout: &layout, artist: &artist, page, count, indexed, watch }
        .write(log, options, out)?;
    let Passed { ends_before, mut damage } = passed;
    damage.extend(scene_lost.filter(|lost| !damage.contains(lost)));
    Ok(Drawn {
        moments: shown.count,
        ends_before,
        followed: subject.follows,
        lost: survey.lost,
        valueless: survey.valueless,
        damage,
    })
}

/// The page without its pictures: title and legend. `few`: in few colours.
fn page(artist: &Artist<'_>, layout: &Layout, title: &str, (beyond, few): ([bool; 2], bool)) -> Canvas {
    let mut page = Canvas::new(layout.size[0], layout.size[1], artist.theme.page);
    sheet::title(&mut page, layout, &artist.text, &artist.theme, title);
    if let Some(strip) = layout.legend {
        let pen = (&artist.text, &artist.theme);
        match &artist.scale {
            Some(scale) => {
                let bar = Bar { scale, beyond, steps: few.then_some(BAR_STEPS) };
                legend::bar(&mut page, strip, layout.em, pen, bar);
            }
            None => legend::clusters(&mut page, strip, layout.em, pen),
        }
        if let Some(corners) = Corners::of_legend(strip, layout.em).filter(|_| layout.cells.len() > 1) {
            artist.measures(&mut page, &corners);
        }
    }
    page
}

/// Lines of box and walls. A camera that is fitted to all takes in the box; a cluster is drawn as a whole, across the
/// faces of a periodic box, which then has no place.
fn domain_lines(scene: Option<&Scene>, subject: &Subject, survey: &mut Survey<'_>) -> Vec<Segment> {
    let Some(domain) = scene.and_then(|scene| scene.domain.as_ref()) else { return Vec::new() };
    let [low, high] = survey.corners();
    match (has_box(domain), subject.members.is_some()) {
        (true, true) => Vec::new(),
        (true, false) => {
            let edges = domain::outline(domain, low, high);
            edges.iter().flatten().for_each(|&end| survey.add_point(end));
            edges.into_iter().chain(domain::walls(domain, low, high)).collect()
        }
        (false, _) => domain::walls(domain, low, high),
    }
}

/// What can be wrong with options by themselves.
fn check(options: &Options) -> Result<(), RenderError> {
    let wrong = |text: String, hint: &str| Err(RenderError::asked(text, hint));
    if !(options.zoom > 0.0 && options.zoom.is_finite()) {
        return wrong(format!("a zoom of {} shows nothing", options.zoom), "give a number above 0; 1 fits all");
    }
    if !(options.magnified > 0.0 && options.magnified.is_finite()) {
        let text = format!("spheres {} times as large as they are cannot be drawn", options.magnified);
        return wrong(text, "give a number above 0; 1 draws them as they are");
    }
    let per_second = options.frames_per_second;
    if !(0.01..=100.0).contains(&per_second) {
        return wrong(format!("{per_second} pictures per second cannot be shown"), "give 0.01 to 100");
    }
    if let Some([low, high]) = options.range
        && !(low < high && (high - low).is_finite())
    {
        return wrong(format!("{low}..{high} is no range of colours"), "give LOW..HIGH with LOW below HIGH");
    }
    Ok(())
}

/// The moments asked for; where nothing is, a hundred for an animation, and the last for a picture.
fn wishes(options: &Options) -> Vec<When> {
    match options.format {
        Format::Apng | Format::Gif if options.at.is_empty() => vec![When::Frames(MOMENTS)],
        _ => options.at.clone(),
    }
}

/// Which moments there are.
struct Shown {
    first: Frame,
    last: Frame,
    count: usize,
}

fn ends<R: Read + Seek>(
    log: &mut Log<R>,
    moments: &Moments,
    particles: &Particles,
    watch: &mut dyn FnMut(usize, usize) -> bool,
) -> Result<Shown, RenderError> {
    let (mut first, mut last, mut count) = (None, None, 0);
    moments.each(log, particles, |frame, _| {
        first.get_or_insert_with(|| frame.clone());
        last = Some(frame.clone());
        count += 1;
        if watch(0, 0) { Ok(()) } else { Err(RenderError::Stopped) }
    })?;
    match (first, last) {
        (Some(first), Some(last)) => Ok(Shown { first, last, count }),
        _ => Err(RenderError::asked("none of the moments asked for is in the log", "`agglo info` says what is in it")),
    }
}

/// The scene, if it is whole: without it there is a picture, but no box and no walls.
fn scene<R: Read + Seek>(log: &mut Log<R>) -> Result<(Option<Scene>, Option<Damage>), RenderError> {
    match log.scene() {
        Ok(scene) => Ok((Some(scene), None)),
        Err(LogError::Damaged(damage)) => Ok((None, Some(damage))),
        Err(other) => Err(other.into()),
    }
}

fn has_box(domain: &Domain) -> bool {
    domain.periodic.is_some_and(|lengths| lengths.iter().any(Option::is_some))
}

/// What colours stand for: what is asked for, where the log has it, or the usual.
fn quantity(options: &Options, particles: &Particles, frame: &Frame) -> Result<Quantity, RenderError> {
    let usual = match Usual::usual(frame.temperature.is_some(), particles.charge.is_some()) {
        Usual::Temperature => Quantity::Temperature,
        Usual::Charge => Quantity::Charge,
        Usual::Speed => Quantity::Speed,
    };
    let Some(asked) = options.color else { return Ok(usual) };
    let missing = match asked {
        Quantity::Temperature if frame.temperature.is_none() => "temperatures",
        Quantity::Charge if particles.charge.is_none() => "charges",
        Quantity::Cluster if frame.cluster.is_none() => "clusters",
        _ => return Ok(asked),
    };
    let mut there = vec!["speed"];
    there.extend(frame.temperature.as_ref().map(|_| "temperature"));
    there.extend(particles.charge.as_ref().map(|_| "charge"));
    there.extend(frame.cluster.as_ref().map(|_| "cluster"));
    let hint = format!("it has {}; without a colour for anything: `none`", there.join(", "));
    Err(RenderError::asked(format!("the log has no {missing} to colour by"), hint))
}

/// Which particles the camera is for, and whether it goes along with them.
fn subject(options: &Options, last: &Frame, scene: Option<&Scene>) -> Result<Subject, RenderError> {
    let fitted = matches!(options.view, View::From { .. });
    // In free space only motion relative to each other means anything; a box and walls stand still.
    let free = scene.is_none_or(|scene| scene.domain.is_none());
    let members = options.cluster.map(|choice| members(choice, last)).transpose()?;
    let periodic = scene.and_then(|scene| scene.domain.as_ref()?.periodic).filter(|_| members.is_some());
    Ok(Subject { follows: fitted && !options.still && (free || members.is_some()), members, periodic })
}

/// The particles of a cluster.
fn members(choice: ClusterChoice, frame: &Frame) -> Result<Vec<usize>, RenderError> {
    let Some(numbers) = &frame.cluster else {
        let text = "the log has no clusters to look at";
        return Err(RenderError::asked(text, "a scene with `binding` or `clusters` counts them"));
    };
    let found = groups(numbers);
    let Some((largest, size)) = found.first().map(|(number, members)| (*number, members.len())) else {
        let text = format!("at {} s there is no cluster of two particles or more", frame.t);
        return Err(RenderError::asked(text, "choose another moment with --at"));
    };
    let chosen = match choice {
        ClusterChoice::Largest => largest,
        ClusterChoice::Number(number) => number,
    };
    found.into_iter().find(|(number, _)| *number == chosen).map(|(_, members)| members).ok_or_else(|| {
        let text = format!("at {} s there is no cluster {chosen} of two particles or more", frame.t);
        RenderError::asked(text, format!("the largest is {largest}, of {size} particles"))
    })
}

fn title<R: Read + Seek>(log: &Log<R>, options: &Options, subject: &Subject) -> String {
    let mut title = log.run().scene_name.clone();
    if let Some(members) = &subject.members {
        let which =
            if options.cluster == Some(ClusterChoice::Largest) { "the largest cluster," } else { "a cluster of" };
        let of = if title.is_empty() { "" } else { ": " };
        title = format!("{title}{of}{which} {} particles", members.len());
    }
    if options.magnified != 1.0 {
        title = format!("{title} (radii × {})", options.magnified);
    }
    title.trim_start().to_owned()
}
