use std::path::PathBuf;

use proptest::prelude::*;

use super::*;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    fn refusal(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        Recording::read(self.file(name, bytes)).unwrap_err().to_string()
    }
}

#[test]
fn units_are_converted_and_time_gives_the_rate() {
    let folder = Folder::new();
    let path = folder.file(
        "a.csv",
        "t [ms],fx [kN],x [um],ax [g],tacho [1]\n0,1,2,1,0\n0.5,-1,4,0,1\n1,0,6,-1,0\n",
    );
    let recording = Recording::read(path).unwrap();
    assert!((recording.sample_rate_hz - 2000.0).abs() < 1e-9);
    assert_eq!(recording.channel("fx").unwrap().samples, [1000.0, -1000.0, 0.0]);
    assert_eq!(recording.channel("x").unwrap().quantity, Quantity::Displacement);
    assert!((recording.channel("x").unwrap().samples[2] - 6e-6).abs() < 1e-18);
    assert_eq!(recording.channel("ax").unwrap().samples[0], 9.806_65);
    assert!(recording.channel("t").is_none());
}

#[test]
fn errors_name_file_line_and_remedy() {
    let folder = Folder::new();
    let good = "t [s],ax [m/s^2]\n0,1\n0.1,2\n";
    for (bytes, words) in [
        (
            "t [s],ax [m/s^2]\n0,1\n0.1,abc\n",
            vec!["line 3", "\"abc\"", "\"ax\"", "number"],
        ),
        ("t [s],ax [m/s^2]\n0,1\n0.1,nan\n", vec!["line 3", "nan"]),
        (
            "t [s],ax [m/s^2]\n0,1\n0.1\n",
            vec!["line 3", "1 values", "2 columns"],
        ),
        ("t [s],ax [parsec]\n0,1\n", vec!["\"ax [parsec]\"", "m/s^2"]),
        (
            "t [s],ax [N]\n0,1\n1,1\n",
            vec!["\"ax\"", "force", "acceleration"],
        ),
        ("t [s],ax [m/s^2]\n0,1\n1,1\n1.1,1\n3,1\n", vec!["not even"]),
        ("t [s],ax [m/s^2]\n1,1\n0,1\n", vec!["must grow"]),
        ("t [s],ax [m/s^2]\n", vec!["no samples"]),
        ("0,1\n0.1,2\n", vec!["line 1", "row of names"]),
        ("ax [m/s^2]\n1\n2\n", vec!["a.toml", "sample_rate_hz"]),
        (
            "t [s],ax [g],ax [g]\n0,1,1\n1,1,1\n",
            vec!["which of several sensors", "ax_2"],
        ),
    ] {
        let message = folder.refusal("a.csv", bytes);
        for word in words.into_iter().chain(["a."]) {
            assert!(message.contains(word), "{word}: {message}");
        }
    }
    for name in ["a.xyz", "a"] {
        // The content decides where the ending says nothing.
        assert!(Recording::read(folder.file(name, good)).is_ok());
        assert!(
            folder
                .refusal(name, "PK\u{3}\u{4}")
                .contains("csv, uff, wav and mat")
        );
    }
    let missing = Recording::read(folder.0.path().join("no.csv")).unwrap_err();
    assert!(missing.to_string().contains("no.csv"));
}

#[test]
fn the_sidecar_names_and_scales_channels() {
    let folder = Folder::new();
    folder.file(
        "a.toml",
        "kind = \"cutting\"\nsample_rate_hz = 1000.0\n[cut]\nteeth = 4\nspindle_rpm = 5000.0\n\
         [channels.data]\nname = \"ay\"\nunit = \"mV\"\nsensitivity = \"10 mV/g\"\nat = \"spindle-housing\"\n",
    );
    let recording = Recording::read(folder.file("a.csv", "data\n20\n-10\n")).unwrap();
    assert_eq!(recording.sample_rate_hz, 1000.0);
    let channel = recording.channel("ay").unwrap();
    assert_eq!(channel.quantity, Quantity::Acceleration);
    // 20 mV at 10 mV/g is 2 g; the tolerance covers rounding.
    assert!((channel.samples[0] - 2.0 * 9.806_65).abs() < 1e-12);
    assert_eq!(recording.sidecar.kind, Some(TestKind::Cutting));

    // An inverted channel is described under its name without the sign.
    folder.file(
        "inverted.toml",
        "sample_rate_hz = 1000.0\n[channels.data]\nname = \"-ay\"\nunit = \"g\"\nanti_aliasing = true\n",
    );
    let inverted = Recording::read(folder.file("inverted.csv", "data\n20\n-10\n")).unwrap();
    let described = inverted.sidecar.channel("ay").unwrap();
    assert_eq!(described.anti_aliasing, Some(true));
    assert!(inverted.channel("ay").unwrap().samples[0] < 0.0);
    assert!(inverted.sidecar.channel("y").is_none());

    for (text, words) in [
        ("sample_rate = 3.0\n", vec!["line 1", "sample_rate"]),
        (
            "sample_rate_hz = -3.0\n",
            vec!["sample_rate_hz = -3", "greater than 0"],
        ),
        ("sample_rate_hz = 10.0\n[cut]\nteeth = 0\n", vec!["cut.teeth = 0"]),
        (
            "sample_rate_hz = 10.0\n[cut]\nstart_deg = nan\n",
            vec!["cut.start_deg = NaN", "finite"],
        ),
        (
            "sample_rate_hz = 10.0\n[cut]\nexit_deg = inf\n",
            vec!["cut.exit_deg = inf", "finite"],
        ),
        (
            "sample_rate_hz = 10.0\n[cut]\nstart_deg = -20\n",
            vec!["cut.start_deg = -20", "from 0 to below 360"],
        ),
        (
            "sample_rate_hz = 10.0\n[cut]\nexit_deg = 400\n",
            vec!["cut.exit_deg = 400", "up to 360"],
        ),
        (
            "sample_rate_hz = 10.0\n[channels.nose]\nat = \"x\"\n",
            vec!["channels.nose", "data"],
        ),
        (
            "sample_rate_hz = 10.0\n[channels.data]\nunit = \"N\"\nsensitivity = \"1 mV/g\"\n",
            vec!["sensitivity", "force"],
        ),
    ] {
        folder.file("a.toml", text);
        let message = folder.refusal("a.csv", "data\n20\n-10\n");
        for word in words.into_iter().chain(["a.toml"]) {
            assert!(message.contains(word), "{word}: {message}");
        }
    }
}

#[test]
fn wav_has_its_rate_and_full_scale_one() {
    let folder = Folder::new();
    let path = folder.0.path().join("a.wav");
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: 48_000,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut writer = hound::WavWriter::create(&path, spec).unwrap();
    for sample in [16_384_i16, -32_768, 0, 8192] {
        writer.write_sample(sample).unwrap();
    }
    writer.finalize().unwrap();
    let recording = Recording::read(&path).unwrap();
    assert_eq!(recording.sample_rate_hz, 48_000.0);
    assert_eq!(recording.channel("ch1").unwrap().samples, [0.5, 0.0]);
    assert_eq!(recording.channel("ch2").unwrap().samples, [-1.0, 0.25]);
    assert!(folder.refusal("b.wav", "RIFFxxxx").contains("WAV"));
}

#[test]
fn blocks_and_edges_match_the_recording() {
    let folder = Folder::new();
    let mut text = String::from("t [s],ax [m/s^2],az [g],tacho [1]\n");
    for index in 0..1000 {
        let tacho = u8::from(index % 100 < 20);
        text += &format!(
            "{},{},{},{tacho}\n",
            f64::from(index) * 1e-3,
            10.0 * (f64::from(index) * 0.3).sin(),
            0.5
        );
    }
    let recording = Recording::read(folder.file("a.csv", &text)).unwrap();
    assert!(
        Sensed::new(&recording, SpindleSettings::default())
            .unwrap_err()
            .to_string()
            .contains("teeth")
    );
    let sensed = Sensed::new(
        &recording,
        SpindleSettings {
            rpm: None,
            teeth: Some(2),
        },
    )
    .unwrap();
    assert_eq!(sensed.blocks.len(), 16);
    assert_eq!(sensed.blocks[15].counts.len(), 1000 - 15 * 64);
    let scale = f64::from(sensed.settings.sensor.meters_per_second2_per_count);
    // 10 m/s² fits into the range ±2 g; tolerance: half a count of rounding.
    assert!((scale / COUNT_2G - 1.0).abs() < 1e-6);
    assert!((f64::from(sensed.blocks[0].counts[5][0]) * scale - 10.0 * 1.5_f64.sin()).abs() <= 0.51 * scale);
    // The first pulse has no rising edge. Nine pulses follow at intervals of 0.1 s; each edge lies between two samples.
    assert_eq!(sensed.edges.len(), 9);
    // The first edge is detected before the usual level change is known, up to one sample early.
    for pair in sensed.edges[1..].windows(2) {
        // Time stamps are integer nanoseconds.
        assert!(
            (pair[1].time.0 - pair[0].time.0).abs_diff(100_000_000) <= 2,
            "{pair:?}"
        );
    }
    let spread: usize = sensed.steps().map(|(_, edges)| edges.len()).sum();
    assert_eq!(spread, 9);
}

#[test]
fn a_given_speed_replaces_the_tachometer() {
    let folder = Folder::new();
    let mut text = String::from("t [s],ax [m/s^2],tacho [1]\n");
    for index in 0..1000 {
        text += &format!("{},1,{}\n", f64::from(index) * 1e-3, u8::from(index % 100 < 20));
    }
    let recording = Recording::read(folder.file("a.csv", &text)).unwrap();
    let sensed = |rpm| Sensed::new(&recording, SpindleSettings { rpm, teeth: Some(2) }).unwrap();
    let stated = sensed(Some(900.0));
    assert_eq!(stated.settings.assumed_speed.map(|speed| speed.0), Some(900.0));
    assert!(stated.settings.wheel.is_none() && stated.edges.is_empty());
    let recorded = sensed(None);
    assert!(recorded.settings.assumed_speed.is_none() && recorded.settings.wheel.is_some());
}

#[test]
fn nan_samples_are_refused_with_channel_and_time_or_left_out() {
    for (value, of_csv, of_wav) in [
        (f32::NAN, "nan", "NaN"),
        (f32::INFINITY, "inf", "inf"),
        (f32::NEG_INFINITY, "-inf", "-inf"),
    ] {
        check_non_finite(value, of_csv, of_wav);
    }
}

/// Checks that a WAV file and a text table with this sample are refused as a whole and where a segment contains it.
fn check_non_finite(value: f32, of_csv: &str, of_wav: &str) {
    let folder = Folder::new();
    let path = folder.0.path().join("a.wav");
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: 10,
        bits_per_sample: 32,
        sample_format: hound::SampleFormat::Float,
    };
    let mut writer = hound::WavWriter::create(&path, spec).unwrap();
    for sample in [0.5_f32, 0.1, 0.25, 0.2, 0.0, value, 0.75, 0.4] {
        writer.write_sample(sample).unwrap();
    }
    writer.finalize().unwrap();
    let csv = format!("t [s],ch1 [V],ch2 [V]\n0,0.5,0.1\n0.1,0.25,0.2\n0.2,0,{of_csv}\n0.3,0.75,0.4\n");
    let csv = folder.file("b.csv", &csv);
    for (path, place) in [
        (&path, format!("\"ch2\": sample 3 at 0.2 s is {of_wav}")),
        (&csv, format!("line 4: \"{of_csv}\" in column \"ch2\"")),
    ] {
        let said = Recording::read(path).unwrap_err().to_string();
        assert!(said.contains(&place) && said.contains("--until-s"), "{said}");
        let before = Segment {
            from_s: None,
            until_s: Some(0.2),
        };
        let read = Recording::read_segment(path, before).unwrap();
        assert_eq!(read.channel("ch1").unwrap().samples, [0.5, 0.25]);
        let whole = Segment {
            from_s: Some(0.0),
            until_s: None,
        };
        let said = Recording::read_segment(path, whole).unwrap_err().to_string();
        assert!(said.contains("sample 3"), "{said}");
    }
    // The sample rate cannot be computed from such time stamps.
    let said = folder.refusal(
        "c.csv",
        format!("t [s],ax [m/s^2]\n0,1\n0.1,2\n{of_csv},3\n0.3,4\n"),
    );
    assert!(said.contains("line 4"), "{said}");
}

/// Acceleration per count in the range ±2 g, m/s².
const COUNT_2G: f64 = 0.061e-3 * 9.806_65;

proptest! {
    #[test]
    fn a_written_recording_reads_back_unchanged(samples in prop::collection::vec(-1e6..1e6f64, 2..50), rate in 1.0..1e5f64) {
        let folder = Folder::new();
        let path = folder.0.path().join("a.csv");
        let recording = Recording {
            path: path.clone(),
            sample_rate_hz: rate,
            start_s: 0.25,
            since_s: 0.0,
            channels: vec![Channel { name: "fx".into(), quantity: Quantity::Force, samples }],
            sidecar: Sidecar { kind: Some(TestKind::Sweep), ..Sidecar::default() },
        };
        recording.write(&path).unwrap();
        let back = Recording::read(&path).unwrap();
        prop_assert_eq!(&back.sidecar, &recording.sidecar);
        // Tolerances: rounding of the time stamps, and nine digits of the samples.
        prop_assert!((back.sample_rate_hz / rate - 1.0).abs() < 1e-9);
        for (a, b) in back.channels[0].samples.iter().zip(&recording.channels[0].samples) {
            prop_assert!((a - b).abs() <= 1e-8 * b.abs());
        }
    }
}

#[test]
fn a_sidecar_that_cannot_be_replaced_leaves_the_old_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let mut recording = Recording {
        path: path.clone(),
        sample_rate_hz: 10.0,
        start_s: 0.0,
        since_s: 0.0,
        channels: vec![Channel {
            name: "ax".into(),
            quantity: Quantity::Acceleration,
            samples: vec![1.0, 2.0, 3.0],
        }],
        sidecar: Sidecar::default(),
    };
    recording.write(&path).unwrap();
    let before = std::fs::read(&path).unwrap();
    // A folder in the place of the sidecar cannot be replaced by a file.
    let sidecar = Sidecar::path_of(&path);
    std::fs::remove_file(&sidecar).unwrap();
    std::fs::create_dir(&sidecar).unwrap();
    recording.channels[0].samples[0] = 5.0;
    assert!(recording.write(&path).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn what_the_sidecar_says_of_a_column_holds_for_its_channel() {
    let folder = Folder::new();
    let path = folder.file(
        "a.csv",
        "Time (s),Hammer X (N),Acc X (g)\n0,1,2\n0.1,2,3\n0.2,3,4\n",
    );
    folder.file("a.toml", "[channels.\"Hammer X\"]\nanti_aliasing = true\n");
    let recording = Recording::read(path).unwrap();
    let said = |name| {
        assert!(recording.channel(name).is_some());
        recording
            .sidecar
            .channel(name)
            .and_then(|channel| channel.anti_aliasing)
    };
    assert_eq!([said("fx"), said("ax")], [Some(true), None]);
    // Messages about a channel name the column of the file.
    let column = recording.sidecar.section_of("ax").unwrap();
    assert_eq!(channel_section(column), "[channels.\"Acc X\"]");
}

/// The unit at the end of a title holds with the option that gives the column its name.
#[test]
fn a_unit_at_the_end_of_a_title_is_kept_by_map() {
    let folder = Folder::new();
    let path = folder.file("a.csv", "t,force_N,acc_g\n0,1,2\n0.1,2,3\n0.2,3,4\n");
    let import = Import {
        map: ["force_N=fx", "acc_g=ax"]
            .map(|map| ColumnMap::parse(map).unwrap())
            .to_vec(),
        ..Import::default()
    };
    let read = Recording::import(path, &import).unwrap();
    let recording = &read.recording;
    assert_eq!(recording.channel("fx").unwrap().quantity, Quantity::Force);
    assert_eq!(recording.channel("ax").unwrap().samples[0], 2.0 * 9.806_65);
}
