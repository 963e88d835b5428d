//! The stages whose cost is measured: lobes, lobe table, FRF, identification, diagnosis and signal chain.

use std::path::Path;
use std::process::{Command, Stdio};

use quietcut_tests::command::{binary, cases};

/// A stage: commands that make its input, and the command whose time is measured. `CASES/` stands for the folder of the cases.
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    input: &'static [&'static str],
    timed: &'static str,
}

impl Stage {
    /// Runs the commands that make the input of the stage.
    pub(crate) fn prepare(&self, folder: &Path) {
        for line in self.input {
            quietcut(folder, line);
        }
    }

    /// Runs the command whose time is measured.
    pub(crate) fn run(&self, folder: &Path) {
        quietcut(folder, self.timed);
    }
}

fn quietcut(folder: &Path, line: &str) {
    let cases = format!("{}/", cases().display());
    let output = Command::new(binary())
        .args(line.split_whitespace().map(|word| word.replace("CASES/", &cases)))
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::null())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{line}: {}: {}",
        output.status,
        String::from_utf8_lossy(&output.stderr)
    );
}

pub(crate) fn stages() -> [Stage; 7] {
    [
        Stage {
            name: "lobes",
            input: &[],
            timed: "lobes CASES/insperger-2dof-ad0.05.toml --rpm 5000:25000:200 --depth-mm 0:10:100 --json",
        },
        Stage {
            name: "lobes with cubic terms",
            input: &[],
            timed: "lobes CASES/kuka-kr90-half-cubic.toml --rpm 480:600:20 --depth-mm 0:14:40 --json",
        },
        Stage {
            name: "lobe table",
            input: &[],
            timed: "table CASES/kuka-kr90-acetal.toml --out kuka.qct",
        },
        Stage {
            name: "FRF",
            input: &[
                "simulate CASES/kuka-kr90-acetal.toml --experiment sweep --direction y --frequency-hz 5:60:2 --force-n 100 --seconds 240 --sample-rate-hz 512 --noise-percent 1 --seed 1 --out band.csv",
            ],
            timed: "frf band.csv --out frf.csv",
        },
        Stage {
            name: "identify",
            input: &[
                "simulate CASES/kuka-kr90-y17-low.toml --experiment step-sine --frequency-hz 16.6:17.9:14 --force-n 1.8,5.8,9.5 --dwell-s 30 --sample-rate-hz 128 --noise-percent 1 --seed 1 --out steps.csv",
            ],
            timed: "identify steps.csv --method harmonic-balance --json",
        },
        Stage {
            name: "diagnose",
            input: &[
                "simulate CASES/kuka-kr90-full.toml --experiment sweep --direction x --frequency-hz 10:25:2 --force-n 20 --seconds 30 --sample-rate-hz 128 --effect cubic-stiffness=-5e12 --effect cubic-stiffness.direction=x --noise-percent 1 --seed 1 --out sweep.csv",
            ],
            timed: "diagnose CASES/kuka-kr90-full.toml sweep.csv --json",
        },
        Stage {
            name: "signal chain",
            input: &[
                "simulate CASES/kuka-kr90-acetal.toml --rpm 900 --depth-mm 2 --seconds 6 --seed 1 --out cut.csv",
            ],
            timed: "replay cut.csv --json",
        },
    ]
}
