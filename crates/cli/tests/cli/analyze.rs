//! `analyze`: the page, tables, JSON, charts and the report; and what a log says that is not so.

use agglo_record::channels::Topic;
use agglo_record::proto::agglo::v1;
use agglo_record::proto::foxglove;

use super::planted::Parts;
use super::{CLOUD, Folder, PAIR};

#[test]
fn all_of_it_at_once() {
    let folder = Folder::with(CLOUD);
    folder.agglo(&["run", "scene.json", "-o", "a.mcap"]).code(0);
    let arguments =
        ["analyze", "a.mcap", "--json", "a.json", "--csv", "tables", "--plot", "a.svg", "--report", "a.html"];
    let ran = folder.agglo(&arguments).code(0);
    assert!(ran.text().contains("the log agrees with itself in all"), "the page comes too: {}", ran.text());
    let json: serde_json::Value = serde_json::from_slice(&folder.read("a.json")).unwrap();
    for key in [
        "format",
        "scene",
        "steps",
        "iterations",
        "rejected_steps",
        "step_size",
        "impacts",
        "energy",
        "clusters",
        "temperature",
    ] {
        assert!(!json[key].is_null(), "{key}");
    }
    let row = &json["energy"].as_array().unwrap()[3];
    for key in [
        "t",
        "kinetic",
        "near_field",
        "binding",
        "external",
        "thermal",
        "reaction_heat",
        "radiated",
        "convected",
        "impact_loss",
        "friction_loss",
        "residual",
    ] {
        assert!(row[key].is_number(), "{key}");
    }
    for key in ["t", "count", "largest", "singletons", "mean_size", "sizes"] {
        assert!(!json["clusters"][0][key].is_null(), "{key}");
    }
    for (key, found) in json["agreement"].as_object().unwrap() {
        // No bound that nothing can exceed, none that everything exceeds.
        assert!(found["at"].is_null() || found["at"]["tolerance"].is_number(), "{key}: {found}");
        assert!(["recomputed", "quadrature", "recorded only"].contains(&found["label"].as_str().unwrap()));
    }
    let svg = String::from_utf8(folder.read("a.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    let table = String::from_utf8(folder.read("tables/energy.csv")).unwrap();
    assert_eq!(table.lines().count(), 102, "a line for the columns, and one for each state");
    // Nothing is replaced unasked, one output at a time.
    folder.agglo(&arguments).code(2).says(&["exists", "--overwrite"]);
    folder
        .agglo(&["analyze", "a.mcap", "--json", "-", "--plot", "-"])
        .code(2)
        .says(&["two results", "standard output"]);
    folder.agglo(&["analyze", "a.mcap", "--report", "a.mcap", "--overwrite"]).code(2).says(&["its own input"]);
    assert!(folder.agglo(&["analyze", "a.mcap", "--json", "-"]).code(0).json()["agrees"] == true);
}

#[test]
fn the_report_needs_nothing_and_runs_nothing() {
    let name = "<script>alert(1)</script> & \\\"quoted\\\"";
    let folder = Folder::with(&PAIR.replace("\"name\": \"pair\"", &format!("\"name\": \"{name}\"")));
    folder.agglo(&["run", "scene.json", "-o", "a.mcap"]).code(0);
    folder.agglo(&["analyze", "a.mcap", "--report", "a.html"]).code(0);
    let html = String::from_utf8(folder.read("a.html")).unwrap();
    assert!(html.contains("&lt;script&gt;alert(1)") && !html.contains("<script>alert"), "text is escaped");
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "<link", "<iframe"] {
        assert!(!html.contains(outside), "{outside}");
    }
    // What a scene does not have is not drawn.
    assert!(html.contains("inetic energy") && !html.contains("temperature [K]"), "{html}");
}

/// Analyses a log in which something was changed, with checksums that hold.
fn changed(change: impl FnOnce(&mut Parts)) -> super::Ran {
    let folder = Folder::with(CLOUD);
    folder.agglo(&["run", "scene.json", "-o", "a.mcap"]).code(0);
    let mut parts = Parts::of(&folder.read("a.mcap"));
    change(&mut parts);
    folder.write("b.mcap", parts.write());
    folder.agglo(&["analyze", "b.mcap"])
}

#[test]
fn what_a_log_says_and_is_not_so_is_told() {
    changed(|_| ()).code(0);
    changed(|p| p.edit(Topic::Energy, 9, |ledger: &mut v1::EnergyLedger| ledger.binding *= 1.0 + 1e-9))
        .code(1)
        .says(&["contradicts itself: binding", "step 9", "replay b.mcap --verify"]);
    changed(|p| p.number(9, 7, 0, |_| f64::NAN)).code(1).says(&["contradicts itself", "step 9"]);
    let twice = |p: &mut Parts| {
        let again = p.messages.clone();
        p.messages = again.into_iter().flat_map(|message| [message.clone(), message]).collect();
    };
    changed(twice).code(3).says(&["step 1 has two messages on /particles", "step 1 has two messages on /diagnostics"]);
    for t in [f64::NAN, -1.0, 1e300] {
        changed(|p| p.edit(Topic::Particles, 9, |cloud: &mut foxglove::PointCloud| cloud.t = t))
            .code(3)
            .says(&["step 9 is of t = ", "and its message on /particles of "]);
    }
    changed(|p| p.messages.retain(|message| message.channel.topic != Some(Topic::ParticlesStatic)))
        .code(3)
        .says(&["the particles are not in the log"]);
    changed(|p| p.messages[0].data = vec![0xff; 50]).code(3).says(&["makes no sense"]);
    for (key, value) in [("n", "50"), ("seed", "9"), ("model", "consistent"), ("time_scale", "NaN")] {
        changed(|p| drop(p.metadata.insert(key.to_owned(), value.to_owned())))
            .code(3)
            .says(&[&format!("says that {key} is {value}")]);
    }
}
