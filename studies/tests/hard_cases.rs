//! The page of hard cases says what the solver does now.

#![allow(missing_docs, clippy::unwrap_used)]

use agglo_studies::hard_cases::{PATH, page};

#[test]
fn the_page_is_current() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join(PATH);
    let there = std::fs::read_to_string(path).unwrap();
    for (line, (there, now)) in there.lines().zip(page().lines()).enumerate() {
        assert_eq!(
            there,
            now,
            "line {}; cargo run --release -p agglo-studies --bin hard-cases writes the page",
            line + 1
        );
    }
}
