//! `didim fleet` on histories as `didim history --out` writes them.

use super::support::{Folder, didim};

const HEADER: &str = "identity,cell,robot,result,time,method,configuration,regrouping,parameter,\
    unit,value,\
    standard_deviation,combined_standard_deviation,monitoring,payload_kg\n";

/// Histories of so many arms, each with an older result, one of another payload and one that is not
/// good.
fn histories(folder: &Folder, arms: usize) -> Vec<String> {
    (0..arms)
        .map(|arm: usize| {
            let mut text = HEADER.to_owned();
            let mut row = |result: usize, fc3: f64, good: bool, payload: &str| {
                let day = result + 1;
                for (name, unit, value) in [("fc3", "N·m", fc3), ("zz1r", "kg·m²", 1.24)] {
                    text += &format!(
                        "{arm}-{result},cabinet \
                         {arm},tx40,{result},2026-11-0{day}T00:00:00Z,didim,c,r,{name},{unit},\
                         {value},\
                         0.01,0.1,{good},{payload}\n"
                    );
                }
            };
            #[expect(clippy::cast_precision_loss, reason = "a few arms")]
            let friction = 6.0 + 0.02 * arm as f64;
            row(0, 90.0, true, "");
            row(1, if arm == 2 { 9.0 } else { friction }, true, "0");
            row(2, 80.0, true, "2.5");
            row(3, 70.0, false, "");
            folder.file(&format!("cabinet-{arm}.csv"), &text)
        })
        .collect()
}

#[test]
fn the_arm_that_is_not_like_the_others_is_found_by_its_parameter() {
    let folder = Folder::new();
    let files = histories(&folder, 8);
    fn fleet(files: &[String], more: &[&str]) -> crate::command_line::support::Outcome {
        let files: Vec<&str> = files.iter().map(String::as_str).collect();
        didim(&[&["fleet"], &files[..], more].concat())
    }
    let said = fleet(&files, &[]).done();
    assert!(
        said.starts_with("8 arms tx40, by didim; 2 parameters; outside of the population: 1"),
        "{said}"
    );
    let rows: Vec<&str> = said.lines().filter(|line| line.starts_with("cabinet")).collect();
    assert_eq!(
        (rows.len(), rows.iter().filter(|row| row.ends_with("no")).count()),
        (5, 4),
        "{said}"
    );
    assert!(rows[0].contains("cabinet 2") && rows[0].contains("fc3"), "{said}");
    assert!(rows[0].contains("N·m") && rows[0].ends_with("yes"), "{said}");

    let json: serde_json::Value = serde_json::from_str(&fleet(&files, &["--json"]).done()).unwrap();
    assert_eq!((&json["schema"], &json["robot"]), (&1.into(), &"tx40".into()));
    // Its newest result that counts, and no other.
    assert_eq!(json["arms"][2]["name"], "cabinet 2");
    assert_eq!(
        (&json["arms"][2]["result"], &json["arms"][2]["time"]),
        (&1.into(), &"2026-11-02T00:00:00Z".into())
    );
    let fc3 = &json["parameters"][0];
    assert_eq!((&fc3["name"], &fc3["unit"]), (&"fc3".into(), &"N·m".into()));
    assert!((fc3["median"].as_f64().unwrap() - 6.09).abs() < 1e-9, "{fc3}");

    // All of them in one file, as a database gives them.
    let joined: String = files
        .iter()
        .map(|file| std::fs::read_to_string(file).unwrap().trim_start_matches(HEADER).to_owned())
        .collect();
    let all_file = folder.file("all.csv", &(HEADER.to_owned() + &joined));
    assert_eq!(fleet(&[all_file], &[]).done(), said);

    fleet(&files[..5], &[]).refused(1, &["5 arms have a result", "needs at least 6"]);
    let text = std::fs::read_to_string(&files[7]).unwrap();
    let other = folder.file("other.csv", &text.replace(",tx40,", ",ur5e,"));
    let mixed = [&files[..6], &[other]].concat();
    fleet(&mixed, &[]).refused(1, &["cabinet 7 is a ur5e", "arms of one type"]);
    let unreadable = folder.file("unreadable.csv", &text.replace("tx40,1,", "tx40,one,"));
    fleet(&[unreadable], &[]).refused(1, &["unreadable.csv", "`one`", "`result`", "history --out"]);
    let strange = folder.file("strange.csv", "a,b\n1,2\n");
    fleet(&[strange], &[]).refused(1, &["strange.csv", "no column `identity`", "history --out"]);
}
