//! Moments on pages: a sheet of all of them, or one page each.

use std::io::{Read, Seek, Write};

use agglo_replay::{Frame, Log};

use crate::artist::Artist;
use crate::canvas::Canvas;
use crate::clusters::ClusterColors;
use crate::encode::{self, Animation, Apng, Gif};
use crate::error::RenderError;
use crate::moments::Moments;
use crate::options::{Format, Options};
use crate::sheet::Layout;

/// Pictures that the colours of a GIF are chosen from.
const SAMPLED: usize = 5;

/// Puts moments on pages.
pub struct Book<'a> {
    /// The moments.
    pub moments: &'a Moments,
    /// Where their pictures stand.
    pub layout: &'a Layout,
    /// Who draws them.
    pub artist: &'a Artist<'a>,
    /// With title and legend, and without pictures.
    pub page: Canvas,
    /// How many moments there are.
    pub count: usize,
    /// Whether a sheet has 256 colours.
    pub indexed: bool,
    /// Hears how many moments are done, of how many, and says whether to go on.
    pub watch: &'a mut dyn FnMut(usize, usize) -> bool,
}

impl Book<'_> {
    /// Draws all and writes it.
    ///
    /// # Errors
    /// A log that cannot be read, an output that refuses bytes, and [`RenderError::Stopped`].
    pub fn write<R: Read + Seek, W: Write>(
        mut self,
        log: &mut Log<R>,
        options: &Options,
        out: W,
    ) -> Result<(), RenderError> {
        let per_second = options.frames_per_second;
        match options.format {
            Format::Png => self.sheet(log, out),
            Format::Apng => {
                let apng = Apng::new(out, &self.page, self.count as u32, per_second)?;
                self.animate(log, Box::new(apng))
            }
            Format::Gif => {
                let samples = self.samples(log)?;
                let gif = Gif::new(out, &samples, &self.artist.exact(), per_second)?;
                self.animate(log, Box::new(gif))
            }
        }
    }

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
    fn animate<R: Read + Seek>(
        &mut self,
        log: &mut Log<R>,
        mut to: Box<dyn Animation + '_>,
    ) -> Result<(), RenderError> {
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
