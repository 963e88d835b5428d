//! Tests of the understanding of columns.

use super::super::import::Import;
use super::super::{ColumnMap, Recording};

fn import(text: &str, sidecar: &str, map: &[&str]) -> Result<Recording, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, text).unwrap();
    std::fs::write(folder.path().join("a.toml"), sidecar).unwrap();
    let import = Import {
        map: map.iter().map(|map| ColumnMap::parse(map).unwrap()).collect(),
        ..Import::default()
    };
    Recording::import(&path, &import)
        .map(|imported| imported.recording)
        .map_err(|error| error.to_string())
}

fn names(recording: &Recording) -> Vec<&str> {
    recording
        .channels
        .iter()
        .map(|channel| channel.name.as_str())
        .collect()
}

const TWO: &str = "Time (s),Force (N),Acc (g)\n0,1,2\n0.1,2,3\n0.2,3,4\n";

#[test]
fn a_direction_is_asked_for_and_given_by_map_or_sidecar() {
    let said = import(TWO, "", &[]).unwrap_err();
    for words in [
        "\"Force\"",
        "direction",
        "--map Force=fx,Acc=ax",
        "a.toml",
        "[channels.Acc] name = \"ax\"",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert_eq!(
        names(&import(TWO, "", &["Force=fy", "3=-ay"]).unwrap()),
        ["fy", "ay"]
    );
    let sidecar = "[channels.Force]\nname = \"fx\"\n[channels.Acc]\nname = \"-ax\"\n";
    let recording = import(TWO, sidecar, &[]).unwrap();
    assert_eq!(names(&recording), ["fx", "ax"]);
    assert_eq!(recording.channels[1].samples[0], -2.0 * 9.806_65);
    // The map takes precedence over the sidecar.
    assert_eq!(names(&import(TWO, sidecar, &["force=fz"]).unwrap()), ["fz", "ax"]);
}

#[test]
fn a_bare_axis_takes_its_quantity_from_the_unit() {
    let text = "t [s],X [g],Y [m/s^2],Z [um],temp [degC]\n0,1,2,3,20\n0.1,2,3,4,21\n";
    assert_eq!(names(&import(text, "", &[]).unwrap()), ["ax", "ay", "z", "temp"]);
}

#[test]
fn what_map_states_is_checked() {
    for (map, words) in [
        ("Foo=fx", "no such column"),
        ("Force=ax", "acceleration"),
        ("Force=fx:2 mV/N", "only a voltage has a sensitivity"),
        ("Force=hxx_re:m/N", "recording over time"),
    ] {
        let said = import(TWO, "", &[map, "Acc=ay"]).unwrap_err();
        assert!(said.contains(words), "{map}: {said}");
    }
    // A name of its own makes a column auxiliary.
    assert_eq!(
        names(&import(TWO, "", &["Force=load", "Acc=ax"]).unwrap()),
        ["load", "ax"]
    );
}

#[test]
fn names_of_channels_read_as_before() {
    let text = "t,fx,ax_2,Data [V],tacho [1]\n0,1,2,3,0\n0.1,2,3,4,1\n";
    assert_eq!(
        names(&import(text, "", &[]).unwrap()),
        ["fx", "ax_2", "data", "tacho"]
    );
}
