//! `--report`: a file that stands by itself, says what the result says, and can be looked at.

use std::process::Command;

use sha2::{Digest, Sha256};

use super::support::{Folder, cia402_cell, data, didim, packed_cell};

/// Identifies the simulated arm; the report and what `--json` says.
fn report(folder: &Folder, method: &str) -> (String, serde_json::Value) {
    let path = folder.path(&format!("{method}.html"));
    let (cell, input) = (packed_cell(), &data().packed_log);
    let command = ["identify", "--cell", &cell, "--input", input, "--method", method, "--json"];
    let json = didim(&[&command[..], &["--report", &path]].concat()).done();
    (std::fs::read_to_string(path).unwrap(), serde_json::from_str(&json).unwrap())
}

/// The texts between every `open` and the `<` after it.
fn texts<'a>(html: &'a str, open: &str) -> Vec<&'a str> {
    html.split(open).skip(1).map(|text| text.split_once('<').unwrap().0).collect()
}

#[test]
fn it_has_its_sections_in_order_and_says_what_the_result_says() {
    let folder = Folder::new();
    for method in ["idim-ls", "didim"] {
        let (html, result) = report(&folder, method);
        let mut sections = vec![
            "Key figures",
            "Parameters",
            "Torque, measured and predicted",
            "Motion",
            "Residuals",
            "Torque delays",
            "Information on each parameter by moves",
            "Missing parameters, and motions that identify them",
            "Friction laws",
            "Nuisance parameters",
            "Convergence",
            "Singular values",
            "Names of parameters",
            "Provenance",
        ];
        sections.retain(|section| method == "didim" || *section != "Convergence");
        // The heading of the verdict has more than text in it.
        assert_eq!(texts(&html, "<h2>")[1..], sections);
        let usable =
            "Usable for monitoring, prediction, physical values and rigid-body models</h2>";
        assert!(html.contains(&format!("<span class=\"what\">Verdict</span>{usable}")));
        assert!(html.contains("<section class=\"verdict applicable\">"));
        assert!(!html.contains("Not for "));
        assert!(!html.contains("http"));

        let parameters = result["parameters"].as_array().unwrap();
        let of_parameters = html.split_once("<h2>Parameters").unwrap().1;
        let of_parameters = of_parameters.split_once("<h2>Torque,").unwrap().0;
        let rows = texts(of_parameters, "<th scope=\"row\">");
        assert_eq!(rows.len(), parameters.len());
        for parameter in parameters {
            let name = parameter["name"].as_str().unwrap();
            assert!(rows.contains(&name), "{name} in {rows:?}");
            // As many digits as the table for people shows, to a tenth of σ.
            let sigma = parameter["standard_deviation"].as_f64().unwrap();
            let shown = html.split_once(&format!("<th scope=\"row\">{name}</th>")).unwrap().1;
            let shown: f64 =
                texts(shown, "<td class=\"number value\">")[0].replace('−', "-").parse().unwrap();
            let value = parameter["value"].as_f64().unwrap();
            assert!((shown - value).abs() <= 0.5 * sigma, "{name}: {shown} for {value}");
        }
        // Three panels per joint, and one of the convergence.
        let panels = html.matches("<svg class=\"panel\"").count();
        assert_eq!(panels, if method == "didim" { 19 } else { 18 });
    }
}

#[test]
fn it_names_its_input_by_content() {
    let folder = Folder::new();
    let (html, _) = report(&folder, "idim-ls");
    let bytes = std::fs::read(&data().packed_log).unwrap();
    let digest: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(html.contains(&digest) && html.contains("<dd>packed.log</dd>"));
    assert!(!html.contains(env!("CARGO_TARGET_TMPDIR")), "no path of this machine");
}

/// Offline the record counts, in the pipeline the window. The report of a stored result has what
/// is stored.
#[test]
fn the_same_input_gives_the_same_bytes() {
    let folder = Folder::new();
    let (one, two) = (report(&folder, "didim").0, report(&folder, "didim").0);
    assert!(one == two);
    fn replay(name: &str, folder: &Folder) -> [String; 2] {
        let (state, path) = (folder.path(name), folder.path(&format!("{name}.html")));
        let (cell, log) = (packed_cell(), &data().packed_log);
        didim(&["replay", "--cell", &cell, log, "--state", &state, "--report", &path]).done();
        let stored = folder.path(&format!("{name}-stored.html"));
        let report = ["report", "0", "--cell", &cell, "--state", &state, "--out", &stored];
        let said = didim(&report).done();
        assert!(said.contains("without curves"), "{said}");
        [path, stored].map(|path| std::fs::read_to_string(path).unwrap())
    }
    let ([shown, stored], again) = (replay("1", &folder), replay("2", &folder));
    assert!([&shown, &stored] == [&again[0], &again[1]]);
    assert!(shown.contains("packed.log") && shown.contains("<dt>Window</dt>"));
    // The store knows no file and keeps no curves. Verdict, parameters and tables are the same.
    assert!(!stored.contains("packed.log") && !stored.contains("Autocorrelation of the residual"));
    let rows = |html: &str| texts(html, "<th scope=\"row\">").len();
    let part = |html: &str| html.split_once("<h2>Torque, measured").unwrap().0.to_owned();
    let main = |html: &str| part(html).split_once("</nav>").unwrap().1.to_owned();
    assert!(main(&shown) == main(&stored));
    assert_eq!(rows(&main(&stored)), 28);
}

/// Before the work that would be lost.
#[test]
fn a_report_that_cannot_be_written_is_reported() {
    let path = "/proc/didim-test.html";
    let (cell, log) = (cia402_cell(), &data().cia402_log);
    let identify = ["identify", "--cell", &cell, "--input", log, "--json", "--report", path];
    let replay = ["replay", "--cell", &cell, log, "--json", "--report", path];
    for command in [&identify[..], &replay[..]] {
        didim(command).refused(1, &[path, "folder"]);
    }
}

/// A browser draws it without an error, at phone width without scrolling sideways.
#[test]
#[ignore = "needs chromium: tests/run"]
fn a_browser_draws_it() {
    let folder = Folder::new();
    report(&folder, "idim-ls");
    report(&folder, "didim");
    // Two results and their residuals, one convergence.
    let comparison = folder.path("comparison.html");
    let (cell, input) = (packed_cell(), &data().packed_log);
    let compare = ["compare", "--cell", &cell, "--input", input, "--methods", "idim-iv"];
    didim(&[&compare[..], &["--folds", "0", "--report", &comparison]].concat()).done();
    for (method, panels) in [("idim-ls", 18), ("didim", 19), ("comparison", 13)] {
        // The title of the page around it says what is drawn.
        let page = format!(
            r#"<!doctype html><meta charset="utf-8">
<iframe src="{method}.html" width="360" height="2000" style="border:0"></iframe>
<iframe src="{method}.html" width="1200" height="2000" style="border:0"></iframe>
<script>onload = () => {{
  document.title = [...document.querySelectorAll("iframe")].map(frame => {{
    const root = frame.contentDocument.documentElement;
    const drawn = [...root.querySelectorAll("svg.panel")].filter(svg => svg.getBBox().width > 300);
    const heading = root.querySelector("h1").getBoundingClientRect();
    return [root.scrollWidth, drawn.length, heading.height > 20].join(" ");
  }}).join(", ");
}}</script>"#
        );
        let page = folder.file("page.html", &page);
        let profile = folder.path("profile");
        let output = Command::new("timeout")
            .args(["60", "chromium", "--headless", "--no-sandbox", "--disable-gpu"])
            .args(["--allow-file-access-from-files", "--enable-logging=stderr"])
            .args(["--window-size=1700,2100", "--dump-dom"])
            .arg(format!("--user-data-dir={profile}"))
            .arg(format!("file://{page}"))
            .output()
            .unwrap();
        let (described, drawn) =
            (String::from_utf8_lossy(&output.stderr), String::from_utf8_lossy(&output.stdout));
        let errors: Vec<&str> = described.lines().filter(|line| line.contains("CONSOLE")).collect();
        assert_eq!(errors, [""; 0]);
        let title = texts(&drawn, "<title>");
        println!("{method}: {title:?}");
        let title = title.first().expect("the page was drawn");
        for (frame, width) in title.split(", ").zip([360, 1200]) {
            let [scroll, found, heading] = frame.split(' ').collect::<Vec<_>>().try_into().unwrap();
            assert!(scroll.parse::<u32>().unwrap() <= width, "{title}");
            assert_eq!((found, heading), (panels.to_string().as_str(), "true"), "{title}");
        }
        assert_eq!(title.matches(", ").count(), 1, "{title}");
    }
}
