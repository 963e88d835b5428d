//! Tests of the understanding of columns.

use super::super::import::Import;
use super::super::{ColumnMap, Recording, Segment};

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

#[test]
fn a_number_of_a_column_is_that_in_the_file() {
    let words = "t,state,p,q\n0,open,1,20\n0.001,error,2,30\n0.002,open,3,40\n";
    let recording = import(words, "", &["1=t:s", "3=fx:N"]).unwrap();
    assert_eq!(recording.channel("fx").unwrap().samples, [1.0, 2.0, 3.0]);
    let counted = ",t,p,q\n0,0,1,20\n1,0.001,2,30\n2,0.002,3,40\n";
    let recording = import(counted, "", &["4=fx:N"]).unwrap();
    assert_eq!(recording.channel("fx").unwrap().samples, [20.0, 30.0, 40.0]);
}

#[test]
fn clock_times_are_seconds_whatever_their_head_says() {
    for head in ["Time [ms]", "Time [hh:mm:ss]", "Zeit in min", "Time"] {
        let text = format!("{head},fx [N]\n12:00:00.000,1\n12:00:00.001,2\n12:00:00.002,3\n");
        let recording = import(&text, "", &[]).unwrap();
        assert!(
            (recording.sample_rate_hz - 1000.0).abs() < 1e-3,
            "{head}: {}",
            recording.sample_rate_hz
        );
    }
    assert!(import("Time,fx [N]\n12:00:00.000,1\n0.001,2\n12:00:00.002,3\n", "", &[]).is_err());
}

#[test]
fn letters_of_an_oscilloscope_take_no_meaning_from_axes_and_units() {
    let text = "t [s],X [g],fx [N],A [deg],B [deg]\n0,1,30,10,20\n0.001,2,30,10,20\n";
    assert_eq!(names(&import(text, "", &[]).unwrap()), ["ax", "fx", "a", "b"]);
    assert!(import("t [h],A,B\n0,1,2\n1,2,3\n", "", &[]).is_err());
}

#[test]
fn speeds_in_revolutions_per_minute_are_auxiliary() {
    let text = "t [s],ax [g],n_set [1/min],Tacho [rpm]\n0,1,100,101\n0.001,2,100,102\n";
    assert_eq!(names(&import(text, "", &[]).unwrap()), ["ax", "n_set", "rpm"]);
}

#[test]
fn a_segment_beside_a_gap_is_read_at_any_time_of_the_clock() {
    for start in [0.0, 1000.0, 1_714_730_000.0] {
        let step = 0.0005;
        let at = |index: usize| start + step * (index + if index < 50 { 0 } else { 400 }) as f64;
        let rows: String = (0..100)
            .map(|index| format!("{:.7},{index}\n", at(index)))
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, format!("t [s],fx [N]\n{rows}")).unwrap();
        let said = Recording::read(&path).unwrap_err().to_string();
        assert!(said.contains("400 samples are missing after sample 50"), "{said}");
        let time_s = |word: &str| -> f64 {
            let rest = said.split_once(word).unwrap().1;
            rest.split([',', ' '])
                .find(|text| !text.is_empty())
                .unwrap()
                .parse()
                .unwrap()
        };
        let part = |segment: Segment| Recording::read_segment(&path, segment).unwrap();
        let before = part(Segment {
            from_s: None,
            until_s: Some(time_s("--until-s")),
        });
        let after = part(Segment {
            from_s: Some(time_s("--from-s")),
            until_s: None,
        });
        assert_eq!((before.len(), after.len()), (50, 50), "{said}");
        assert_eq!(after.channels[0].samples[0], 50.0);
        assert!((after.start_s - at(50)).abs() < 1e-6);
    }
}
