//! `agglo run --live` of a program that was built without it: says how to get it.

use agglo_core::scene::Scene;
use agglo_record::Tap;

use crate::failure::{Failure, Message};
use crate::terminal::Terminal;

/// Nobody can be let watch.
pub enum Live {}

impl Live {
    /// Refuses.
    ///
    /// # Errors
    /// Always.
    pub fn start(_: &str, _: &Scene, _: &Terminal) -> Result<Self, Failure> {
        let hint = "`cargo install --path crates/cli --features live` builds one with it";
        Err(Failure::Input(Message::new("this agglo was built without --live, the cargo feature `live`").hint(hint)))
    }

    /// Never called: there is none.
    pub fn tap(&self) -> Tap {
        match *self {}
    }

    /// Never called: there is none.
    pub fn finish(self) {
        match self {}
    }
}
