//! From a log to a picture: what is shown, how far it reaches, and then moment by moment.

use std::io::{Read, Seek, Write};

use agglo_core::scene::Scene;
use agglo_core::state::Particles;
use agglo_record::channels::Topic;
use agglo_record::palette::Shown;
use agglo_replay::{Damage, Frame, Log, LogError, Message};
use nalgebra::Vector3;

use crate::camera::{Camera, axes};
use crate::canvas::{Canvas, Rgb};
use crate::clusters::{ClusterColors, groups};
use crate::colors::{PLAIN, SINGLE, Scale};
use crate::domain;
use crate::encode::{self, Animation, Apng, Gif};
use crate::error::RenderError;
use crate::legend;
use crate::moments::{Moments, Passed};
use crate::occlusion::{Occlusion, Sphere};
use crate::options::{ClusterChoice, Format, Options, Quantity, View, When};
use crate::quantity::Clock;
use crate::shading::light;
use crate::sheet::{self, Corners, Layout, Theme};
use crate::spheres::{Ball, Line, Stage, paint};
use crate::survey::{Subject, Survey, is_finite, suggested, value};
use crate::text::Text;

/// Pictures of an animation where nothing is said about its moments.
const MOMENTS: f64 = 100.0;
/// Pictures that the colours of a GIF are chosen from.
const SAMPLED: usize = 5;

/// Share of the ground's colour that the farthest part of a large cloud takes on [-].
const HAZE: f32 = 0.14;

/// Steps of the colour bar that a picture of few colours keeps.
const BAR_STEPS: u32 = 33;

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
    /// Parts of the log that could not be read.
    pub damage: Vec<Damage>,
}

/// Draws moments of a log as the options say. `watch` hears how many moments are done, of how many, and says whether to
/// go on.
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
    let particles = log.particles()?;
    let moments = Moments::new(&wishes(log, options)?);
    let (first, last, count) = ends(log, &moments, &particles)?;
    let quantity = quantity(options, &particles, &last)?;
    let (scene, scene_lost) = scene(log)?;
    let subject = subject(options, &last, scene.as_ref())?;
    let cells = if options.format == Format::Png { count } else { 1 };
    let layout = Layout::new(options, cells, options.legend && legend::has(quantity))?;
    let Some(cell) = layout.cells.first().copied() else {
        return Err(RenderError::asked("there is no moment to draw", "choose one with --at"));
    };
    let size = [cell.width, cell.height];

    let mut survey = Survey::new(&particles, &subject, quantity, (axes(options.view)?, size));
    let passed = moments.each(log, &particles, |frame, _| {
        survey.add(frame);
        Ok(())
    })?;
    let suggested = match (&scene, quantity) {
        (Some(scene), Quantity::Temperature) => suggested(scene, &particles, &beginning(log)?.unwrap_or(first)),
        _ => None,
    };
    let segments = scene.as_ref().and_then(|scene| scene.domain.as_ref()).map_or_else(Vec::new, |domain| {
        let [low, high] = survey.corners();
        domain::segments(domain, low, high)
    });
    if subject.members.is_none() && scene.as_ref().is_some_and(|scene| has_box(scene)) {
        // The twelve edges come first.
        segments.iter().take(12).flatten().for_each(|&end| survey.add_point(end));
    }
    let (camera, depths) = survey.camera(options, size)?;
    let (scale, beyond) = survey.scale(options, suggested);
    let (lost, clock) = (survey.lost, Clock::new(&survey.times));
    let artist = Artist {
        particles: &particles,
        subject: &subject,
        quantity,
        scale,
        camera,
        depths,
        segments,
        clock,
        theme: Theme::new(options.dark),
        text: Text::new(),
        em: layout.em,
        size,
    };

    let mut page = Canvas::new(layout.size[0], layout.size[1], artist.theme.page);
    sheet::title(&mut page, &layout, &artist.text, &artist.theme, &title(log, options, &subject));
    if let Some(strip) = layout.legend {
        let pen = (&artist.text, &artist.theme);
        match &artist.scale {
            Some(scale) => legend::bar(&mut page, strip, layout.em, pen, (scale, beyond)),
            None => legend::clusters(&mut page, strip, layout.em, pen),
        }
        if let Some(corners) = Corners::of_legend(strip, layout.em).filter(|_| layout.cells.len() > 1) {
            artist.measures(&mut page, &corners);
        }
    }
    let mut book = Book { moments: &moments, layout: &layout, artist: &artist, page, count, indexed: options.indexed, watch };
    match options.format {
        Format::Png => book.sheet(log, out)?,
        Format::Apng => {
            let apng = Apng::new(out, &book.page, count as u32, options.frames_per_second)?;
            book.animate(log, Box::new(apng))?;
        }
        Format::Gif => {
            let samples = book.samples(log)?;
            let gif = Gif::new(out, &samples, &artist.exact(), options.frames_per_second)?;
            book.animate(log, Box::new(gif))?;
        }
    }
    let Passed { ends_before, mut damage } = passed;
    damage.extend(scene_lost.filter(|lost| !damage.contains(lost)));
    Ok(Drawn { moments: count, ends_before, followed: subject.follows, lost, damage })
}

/// What can be wrong with options by themselves.
fn check(options: &Options) -> Result<(), RenderError> {
    let wrong = |text: String, hint: &str| Err(RenderError::asked(text, hint));
    if !(options.zoom > 0.0 && options.zoom.is_finite()) {
        return wrong(format!("a zoom of {} shows nothing", options.zoom), "give a number above 0; 1 fits all");
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
fn wishes<R: Read + Seek>(log: &mut Log<R>, options: &Options) -> Result<Vec<When>, RenderError> {
    if options.format == Format::Png || !options.at.is_empty() {
        return Ok(options.at.clone());
    }
    let start = beginning(log)?.map_or(0.0, |frame| frame.t);
    let end = log.last_frame()?.t;
    let spacing = (end - start) / MOMENTS;
    Ok(if spacing > 0.0 { vec![When::Every(spacing), When::End] } else { vec![When::End] })
}

/// The first state that is whole.
fn beginning<R: Read + Seek>(log: &mut Log<R>) -> Result<Option<Frame>, RenderError> {
    for entry in log.messages().only(&[Topic::Particles]) {
        match entry {
            Ok(entry) => {
                if let Message::Particles(frame) = entry.message {
                    return Ok(Some(frame));
                }
            }
            Err(LogError::Damaged(_)) => {}
            Err(other) => return Err(other.into()),
        }
    }
    Ok(None)
}

/// The first and the last moment, and how many there are.
fn ends<R: Read + Seek>(
    log: &mut Log<R>,
    moments: &Moments,
    particles: &Particles,
) -> Result<(Frame, Frame, usize), RenderError> {
    let (mut first, mut last, mut count) = (None, None, 0);
    moments.each(log, particles, |frame, _| {
        first.get_or_insert_with(|| frame.clone());
        last = Some(frame.clone());
        count += 1;
        Ok(())
    })?;
    match (first, last) {
        (Some(first), Some(last)) => Ok((first, last, count)),
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

fn has_box(scene: &Scene) -> bool {
    let periodic = scene.domain.as_ref().and_then(|domain| domain.periodic);
    periodic.is_some_and(|lengths| lengths.iter().any(Option::is_some))
}

/// What colours stand for: what is asked for, where the log has it, or the usual.
fn quantity(options: &Options, particles: &Particles, frame: &Frame) -> Result<Quantity, RenderError> {
    let usual = match Shown::usual(frame.temperature.is_some(), particles.charge.is_some()) {
        Shown::Temperature => Quantity::Temperature,
        Shown::Charge => Quantity::Charge,
        Shown::Speed => Quantity::Speed,
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
    Ok(Subject { follows: fitted && !options.still && (free || members.is_some()), members })
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

fn title<R>(log: &Log<R>, options: &Options, subject: &Subject) -> String
where
    R: Read + Seek,
{
    let name = &log.run().scene_name;
    match &subject.members {
        Some(members) if options.cluster == Some(ClusterChoice::Largest) => {
            format!("{name}: the largest cluster, {} particles", members.len())
        }
        Some(members) => format!("{name}: a cluster of {} particles", members.len()),
        None => name.clone(),
    }
}

/// Draws single moments.
struct Artist<'a> {
    particles: &'a Particles,
    subject: &'a Subject,
    quantity: Quantity,
    scale: Option<Scale>,
    camera: Camera,
    depths: [f64; 2],
    segments: Vec<domain::Segment>,
    clock: Clock,
    theme: Theme,
    text: Text,
    em: f32,
    size: [usize; 2],
}

impl Artist<'_> {
    /// A moment; one that is alone has axes and a length in its corners.
    fn moment(&self, frame: &Frame, colors: &mut ClusterColors, alone: bool) -> Canvas {
        let anchor = self.subject.anchor(self.particles, frame);
        let camera = Camera { eye: self.camera.eye + anchor, ..self.camera };
        let balls = self.balls(frame, &camera, colors);
        let spheres: Vec<Sphere> = balls.iter().filter(|ball| !ball.faded).map(|ball| ball.sphere).collect();
        let lines = self.lines(&camera);
        let stage = Stage {
            camera: &camera,
            balls: &balls,
            lines: &lines,
            occlusion: &Occlusion::new(&spheres),
            ground: light(self.theme.ground),
            depths: self.depths,
            haze: self.haze(),
        };
        let mut canvas = Canvas::new(self.size[0], self.size[1], self.theme.ground);
        paint(&stage, &mut canvas);
        let em = self.em;
        sheet::time(&mut canvas, em, &self.text, &self.theme, &self.clock.text(frame.t));
        if let Some(corners) = Corners::of_picture(self.size, em).filter(|_| alone) {
            self.measures(&mut canvas, &corners);
        }
        canvas
    }

    /// Colours that a picture of few colours keeps as they are: those of the page, and steps of the colour bar.
    fn exact(&self) -> Vec<Rgb> {
        let bar = self.scale.iter().flat_map(|scale| (0..BAR_STEPS).map(|k| scale.at(f64::from(k) / f64::from(BAR_STEPS - 1))));
        self.theme.exact().into_iter().chain(bar).collect()
    }

    /// Haze sets what is behind apart from what is in front, not the parts of one sphere.
    fn haze(&self) -> f32 {
        let radii = self.particles.radius.iter().copied().filter(|radius| radius.is_finite());
        let (largest, deep) = (2.0 * radii.fold(0.0, f64::max), self.depths[1] - self.depths[0]);
        if deep > largest { HAZE * (1.0 - largest / deep) as f32 } else { 0.0 }
    }

    /// Axes and a length.
    fn measures(&self, canvas: &mut Canvas, corners: &Corners) {
        let (pen, middle) = ((&self.text, &self.theme), 0.5 * (self.depths[0] + self.depths[1]));
        sheet::triad(canvas, corners, pen, &self.camera);
        sheet::ruler(canvas, corners, pen, (&self.camera, middle, self.size[0]));
    }

    fn balls(&self, frame: &Frame, camera: &Camera, colors: &mut ClusterColors) -> Vec<Ball> {
        let particles = self.particles;
        let by_cluster = match (&frame.cluster, self.quantity) {
            (Some(numbers), Quantity::Cluster) => Some(colors.next(numbers)),
            _ => None,
        };
        let color = |i: usize| -> Rgb {
            match (&by_cluster, &self.scale) {
                (Some(colors), _) => colors.get(i).copied().unwrap_or(SINGLE),
                (None, Some(scale)) => scale.color(value(self.quantity, particles, frame, i).unwrap_or(f64::NAN)),
                (None, None) => PLAIN,
            }
        };
        let members = self.subject.members.as_ref();
        let mut balls: Vec<Ball> = (0..particles.len())
            .filter(|&i| is_finite(particles, frame, i))
            .map(|i| Ball {
                sphere: Sphere { centre: camera.view(frame.position.get(i)), radius: particles.radius[i] },
                color: light(color(i)),
                faded: members.is_some_and(|members| members.binary_search(&i).is_err()),
            })
            .collect();
        balls.sort_by_key(|ball| ball.faded);
        balls
    }

    fn lines(&self, camera: &Camera) -> Vec<Line> {
        let (color, width) = (light(self.theme.line), (0.07 * f64::from(self.em)).max(1.0));
        let line = |ends: &[Vector3<f64>; 2]| Line { ends: ends.map(|end| camera.view(end)), color, width };
        self.segments.iter().map(line).collect()
    }
}

/// Puts moments on pages.
struct Book<'a> {
    moments: &'a Moments,
    layout: &'a Layout,
    artist: &'a Artist<'a>,
    /// With title and legend, and without pictures.
    page: Canvas,
    count: usize,
    indexed: bool,
    watch: &'a mut dyn FnMut(usize, usize) -> bool,
}

impl Book<'_> {
    fn heard(&mut self, done: usize) -> Result<(), RenderError> {
        if (self.watch)(done, self.count) { Ok(()) } else { Err(RenderError::Stopped) }
    }

    /// All moments side by side.
    fn sheet<R: Read + Seek, W: Write>(&mut self, log: &mut Log<R>, out: W) -> Result<(), RenderError> {
        let (moments, artist, layout) = (self.moments, self.artist, self.layout);
        let (mut done, mut colors) = (0, ClusterColors::default());
        moments.each(log, artist.particles, |frame, _| {
            let cell = artist.moment(frame, &mut colors, layout.cells.len() == 1);
            if let Some(rect) = layout.cells.get(done) {
                self.page.paste(&cell, rect.x, rect.y);
            }
            done += 1;
            self.heard(done)
        })?;
        if self.indexed {
            return Ok(encode::png_indexed(out, &self.page, &artist.exact())?);
        }
        Ok(encode::png(out, &self.page)?)
    }

    /// A page per moment.
    fn animate<R: Read + Seek>(&mut self, log: &mut Log<R>, mut to: Box<dyn Animation + '_>) -> Result<(), RenderError> {
        let (moments, artist) = (self.moments, self.artist);
        let (mut done, mut colors) = (0, ClusterColors::default());
        moments.each(log, artist.particles, |frame, times| {
            to.add(&self.turned_to(frame, &mut colors), times)?;
            done += 1;
            self.heard(done)
        })?;
        Ok(to.finish()?)
    }

    fn turned_to(&self, frame: &Frame, colors: &mut ClusterColors) -> Canvas {
        let mut page = self.page.clone();
        if let Some(rect) = self.layout.cells.first() {
            page.paste(&self.artist.moment(frame, colors, true), rect.x, rect.y);
        }
        page
    }

    /// A few pages, evenly spread.
    fn samples<R: Read + Seek>(&mut self, log: &mut Log<R>) -> Result<Vec<Canvas>, RenderError> {
        let chosen: Vec<usize> = (0..SAMPLED).map(|k| k * (self.count - 1) / (SAMPLED - 1)).collect();
        let (mut number, mut pages) = (0, Vec::new());
        let mut colors = ClusterColors::default();
        self.moments.each(log, self.artist.particles, |frame, _| {
            if chosen.contains(&number) {
                pages.push(self.turned_to(frame, &mut colors));
            }
            number += 1;
            if (self.watch)(0, self.count) { Ok(()) } else { Err(RenderError::Stopped) }
        })?;
        Ok(pages)
    }
}
