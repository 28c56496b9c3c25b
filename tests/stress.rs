//! Extreme cases hold, and fail when the safeguard that they are there for is off.

use super::support::renderer;
use glimt::render::Sabotage;
use glimt::stress::{run, Case, Settings, CASES};
use glimt::Options;

fn quick() -> Settings {
    Settings { quick: true, export: None }
}

#[test]
fn every_case_holds() {
    let rows = run(renderer(), &CASES, &quick(), &Options::default(), &mut |row| println!("{}", row.text())).unwrap();
    let failed: Vec<String> = rows.iter().filter(|row| !row.holds).map(|row| row.text()).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(CASES.iter().all(|case| rows.iter().any(|row| row.case == case.name)), "a case has no row");
}

#[test]
fn without_its_safeguard_a_case_fails() {
    let pairs = [
        ("self-hit", Sabotage::FixedEpsilon),
        ("leaks", Sabotage::MollerTrumbore),
        ("self-hit", Sabotage::SureOfThin),
        ("leaks", Sabotage::TightBoxes),
        ("far-away", Sabotage::NoRebase),
        ("radiance", Sabotage::PlainSums),
    ];
    for (name, sabotage) in pairs {
        let cases: Vec<Case> = CASES.into_iter().filter(|case| case.name == name).collect();
        let options = Options { sabotage: Some(sabotage), ..Options::default() };
        let rows = run(renderer(), &cases, &quick(), &options, &mut |_| ()).unwrap();
        let wrong: u64 = rows.iter().filter(|row| !row.holds).map(|row| row.wrong).sum();
        println!("{name} without its safeguard ({sabotage:?}): {wrong} wrong");
        assert!(wrong > 0, "{name} holds with {sabotage:?}");
    }
}
