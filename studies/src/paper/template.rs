//! Text with named gaps, `{{name}}`, and what fills them.

use std::collections::BTreeMap;

use crate::Failure;

/// Fills every gap of a text.
///
/// # Errors
/// A gap without a value, a gap that does not end, and a value without a gap: either would be a slip in the page.
pub fn fill(template: &str, values: &BTreeMap<&str, String>) -> Result<String, Failure> {
    let mut unused = values.clone();
    let mut filled = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").ok_or("a gap of the page does not end")?;
        let value = values.get(name).ok_or_else(|| format!("nothing fills the gap `{name}` of the page"))?;
        unused.remove(name);
        filled.push_str(before);
        filled.push_str(value);
        rest = after;
    }
    filled.push_str(rest);
    match unused.keys().next() {
        None => Ok(filled),
        Some(name) => Err(format!("the page has no gap `{name}`").into()),
    }
}

/// A Markdown table.
#[must_use]
pub fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let mut text = line(head.iter().map(ToString::to_string).collect());
    text.push_str(&line(head.iter().map(|_| "---:".to_owned()).collect()));
    for row in rows {
        text.push_str(&line(row.clone()));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_and_slips_are_found() {
        let values = BTreeMap::from([("a", "1".to_owned()), ("b", "{{a}}".to_owned())]);
        // Values are not looked at for gaps.
        assert_eq!(fill("x {{a}} y {{b}}{{a}} z", &values).unwrap(), "x 1 y {{a}}1 z");
        assert!(fill("{{a}} {{b}} {{c}}", &values).unwrap_err().to_string().contains("`c`"));
        assert!(fill("{{a}}", &values).unwrap_err().to_string().contains("`b`"));
        assert!(fill("{{a", &values).is_err());
    }

    #[test]
    fn tables_have_a_line_per_row() {
        let text = table(&["x", "y"], &[vec!["1".to_owned(), "2".to_owned()]]);
        assert_eq!(text, "| x | y |\n| ---: | ---: |\n| 1 | 2 |\n");
    }
}
