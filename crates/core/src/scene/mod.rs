//! The scene format: types, text to types, and the checks that a type cannot express.
//!
//! A text becomes a tree of values that know their place (`tree`); settings are put in (`setting`); the tree is checked
//! against the JSON Schema that is generated from the types (`schema`, `check`); serde makes a [`Scene`] of it; and what
//! concerns several values at once is checked on the scene (`validate`).

mod check;
mod problem;
mod schema;
mod setting;
mod tree;
mod types;
mod units;
mod validate;
mod words;

pub use problem::{Problem, line_column};
pub use schema::json_schema;
pub use setting::Setting;
pub use types::*;

/// What the JSON Schema has against a value: keys, types and ranges, but no combinations; empty if nothing.
#[must_use]
pub fn check_value(value: &serde_json::Value) -> Vec<Problem> {
    let mut problems = Problems::default();
    let node = tree::Node::from_value(value, &tree::Origin::Memory);
    check::check(&node, "", schema::schema(), schema::schema(), &mut problems);
    problems.finish()
}

/// Finds the places of problems that know only their pointer, such as those of [`crate::SetupError`], in the text and
/// settings that the scene was read from. A problem with a place keeps it; a text that is no JSON gives none.
pub fn locate(problems: &mut [Problem], text: &str, settings: &[Setting]) {
    let Ok(mut root) = tree::parse(text) else { return };
    for (index, setting) in settings.iter().enumerate() {
        // Settings that cannot be applied were refused when the scene was read.
        let _ = setting.apply(index, &mut root);
    }
    problem::locate(problems, text, &root, settings);
}

pub(crate) use problem::Problems;
pub(crate) use validate::sphere_mass;
pub(crate) use words::short;

impl Scene {
    /// Reads a scene from JSON with comments and trailing commas, after applying `settings` in order.
    ///
    /// # Errors
    /// Everything found wrong, in the order of the text; never empty. What concerns several values at once, as in
    /// [`Scene::validate`], is looked at only if every value is right by itself.
    pub fn parse(text: &str, settings: &[Setting]) -> Result<Self, Vec<Problem>> {
        let mut root = tree::parse(text).map_err(|problem| vec![problem])?;
        let mut problems = Problems::default();
        for (index, setting) in settings.iter().enumerate() {
            if let Err(problem) = setting.apply(index, &mut root) {
                problems.push(problem);
            }
        }
        check::check(&root, "", schema::schema(), schema::schema(), &mut problems);
        let located = |problems: Problems| {
            let mut problems = problems.finish();
            problem::locate(&mut problems, text, &root, settings);
            problems
        };
        if !problems.is_empty() {
            return Err(located(problems));
        }
        match serde_json::from_value::<Self>(root.to_value()) {
            Ok(mut scene) => {
                scene.schema = None;
                scene.cross_check(&mut problems);
                if problems.is_empty() { Ok(scene) } else { Err(located(problems)) }
            }
            // The schema accepts nothing that the types refuse; if it ever does, this is no reason to panic.
            Err(error) => Err(vec![Problem::new("", format!("the scene cannot be read: {error}"))]),
        }
    }

    /// What is wrong with this scene: values out of range and combinations that make no sense; empty if nothing is.
    ///
    /// [`Scene::parse`] has checked all of it. Scenes that are put together in memory, or whose particles came from a
    /// file, are checked by this; [`crate::placement::place`] does so.
    #[must_use]
    pub fn validate(&self) -> Vec<Problem> {
        let mut problems = Problems::default();
        self.range_check(&mut problems);
        if problems.is_empty() {
            self.cross_check(&mut problems);
        }
        problems.finish()
    }

    /// The scene as strict JSON, which reads back as an equal scene.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Serialisation of these types cannot fail: their keys are strings. An empty text reads back as an error.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }
}
