//! `docs/hard-cases.md`: the table of hard cases that tests assert, as a page.

use std::fmt::Write as _;

use agglo_tests::hard::{Answer, CASES, HardCase, Judgement, SCHEMES, Scheme};

/// Where the page is, from the workspace's folder.
pub const PATH: &str = "docs/hard-cases.md";

const HEAD: &str = "# Hard cases

Situations in which particle codes go wrong, what is right, and what each of our schemes makes of them. Written by

```sh
cargo run --release -p agglo-studies --bin hard-cases
```

The cases are `agglo_tests::hard::CASES`; a test of the same name asserts every row (`tests/tests/physics/hard_table.rs`), and
another that this page is current. *Right* means within the bound that the case states in its code, round-off where there is a
closed form. *Refused* is an error with a name, before the run or in it; never a wrong number. `velocity-verlet` is what
`consistent` takes where a scene has impacts or jumps of forces; it must be right everywhere. The schemes of collocation,
`gauss-legendre` and `gauss-radau`, solve impacts but refuse contacts that fields press to rest. Model `paper` is the paper's own scheme, with its failures.
";

/// The page, from running every case.
#[must_use]
pub fn page() -> String {
    let rows: Vec<(&HardCase, Vec<Answer>)> =
        CASES.iter().map(|case| (case, SCHEMES.iter().map(|&scheme| case.answer(scheme)).collect())).collect();
    let mut text = HEAD.to_owned();
    verdicts(&mut text, &rows);
    for scheme in SCHEMES {
        details(&mut text, scheme, &rows);
    }
    text
}

fn verdicts(text: &mut String, rows: &[(&HardCase, Vec<Answer>)]) {
    text.push_str("\n| case | right answer |");
    SCHEMES.iter().for_each(|scheme| _ = write!(text, " `{}` |", scheme.name()));
    text.push_str("\n|---|---|");
    SCHEMES.iter().for_each(|_| text.push_str("---|"));
    text.push('\n');
    for (case, answers) in rows {
        _ = write!(text, "| {} | {} |", cell(case.case), cell(case.right));
        answers.iter().for_each(|answer| _ = write!(text, " {} |", word(answer.judgement())));
        text.push('\n');
    }
}

fn word(judgement: Judgement) -> &'static str {
    match judgement {
        Judgement::Right => "right",
        Judgement::Wrong => "**wrong**",
        Judgement::Refused => "refused",
    }
}

/// What one scheme found; refusals for the same reason in one line.
fn details(text: &mut String, scheme: Scheme, rows: &[(&HardCase, Vec<Answer>)]) {
    let column = SCHEMES.iter().position(|&other| other == scheme).unwrap_or_default();
    _ = write!(text, "\n## `{}`\n\n| case | found | |\n|---|---|---|\n", scheme.name());
    let mut refused: Vec<(&str, Vec<&str>)> = Vec::new();
    for (case, answers) in rows {
        match &answers[column] {
            Answer::Found { measured, .. } => {
                _ = writeln!(text, "| {} | {} | {} |", case.name, cell(measured), word(answers[column].judgement()));
            }
            Answer::Refused(why) => match refused.iter_mut().find(|(known, _)| known == why) {
                Some((_, names)) => names.push(case.name),
                None => refused.push((why, vec![case.name])),
            },
        }
    }
    for (why, names) in refused {
        _ = writeln!(text, "\nRefused: {}: \"{why}\"", names.join(", "));
    }
}

/// Text that does not end a cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
