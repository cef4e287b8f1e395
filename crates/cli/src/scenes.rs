//! The scenes that come along with the program. Their files are copies of the repository's `scenes/`, because a package
//! can only hold what lies in its own folder; a check keeps them equal.

/// A scene by name.
#[derive(Clone, Copy, Debug)]
pub struct ShippedScene {
    /// Its name, which is also its file's.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

macro_rules! shipped {
    ($($name:literal),+ $(,)?) => {
        /// All of them, in the order in which they are listed.
        pub const SHIPPED: &[ShippedScene] =
            &[$(ShippedScene { name: $name, text: include_str!(concat!("../scenes/", $name, ".json")) }),+];
    };
}

shipped! {
    "clustering",
    "paper-binding-1e6",
    "paper-binding-2e6",
    "paper-binding-4e6",
    "paper-binding-8e6",
    "paper-free-1e6",
    "paper-free-2e6",
    "paper-free-4e6",
    "paper-free-8e6",
    "two-body-oscillator",
    "head-on-impact",
    "oblique-impact",
    "bouncing-ball",
    "cooling-sphere",
    "free-cooling-gas",
    "charged-cloud",
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::*;

    fn files(folder: &Path) -> BTreeMap<String, String> {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let json = entries.filter(|path| path.extension().is_some_and(|ending| ending == "json"));
        json.map(|path| (path.file_stem().unwrap().to_string_lossy().into(), std::fs::read_to_string(&path).unwrap()))
            .collect()
    }

    #[test]
    fn every_scene_is_shipped_as_it_is_in_the_repository() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let repository = here.join("../../scenes");
        // A package that was unpacked on its own has no repository to compare with.
        let expected = files(&if repository.is_dir() { repository } else { here.join("scenes") });
        let shipped: BTreeMap<_, _> = SHIPPED.iter().map(|s| (s.name.to_owned(), s.text.to_owned())).collect();
        assert!(shipped == expected, "`cargo xtask gen` copies scenes/ to crates/cli/scenes/; names go to scenes.rs");
    }

    #[test]
    fn every_scene_is_valid_and_says_what_it_shows() {
        for scene in SHIPPED {
            let parsed = agglo_core::Scene::parse(scene.text, &[]).unwrap();
            assert!(parsed.description.is_some_and(|text| text.len() > 40), "{}", scene.name);
        }
    }
}
