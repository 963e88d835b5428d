//! The firmware images that `tests/build-firmware` builds.

use std::path::{Path, PathBuf};
use std::{env, fs};

use object::{Object, ObjectSymbol};

/// The image of the emulated board.
pub fn qemu_mps2() -> PathBuf {
    image("qemu_mps2")
}

/// The image of the real board.
pub fn nucleo_g474re() -> PathBuf {
    image("nucleo_g474re")
}

/// The image that counts instructions in the emulator.
pub fn count_instructions() -> PathBuf {
    image("examples/count_instructions")
}

/// The image that counts the instructions of the signal chain for each block.
pub fn count_blocks() -> PathBuf {
    image("examples/count_blocks")
}

/// Size in bytes of the stack of the real board.
pub fn nucleo_stack_bytes() -> usize {
    let bytes = fs::read(nucleo_g474re()).expect("the image");
    let elf = object::File::parse(&*bytes).expect("an ELF file");
    let address = |name: &str| {
        let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(name));
        symbol.unwrap_or_else(|| panic!("no symbol {name}")).address()
    };
    (address("_stack_start") - address("_stack_end")) as usize
}

/// Path of an image. Fails the test if the image is missing or older than a source from which it was built.
fn image(name: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    let image = target.join("thumbv7em-none-eabihf/firmware").join(name);
    let Ok(built) = fs::metadata(&image).and_then(|m| m.modified()) else {
        panic!(
            "the firmware image {} is missing: run tests/build-firmware",
            image.display()
        );
    };
    // Beside the image, Cargo lists the sources from which it was built.
    let sources = fs::read_to_string(image.with_extension("d")).unwrap_or_default();
    for source in sources
        .split_once(':')
        .map_or("", |(_, list)| list)
        .split_whitespace()
    {
        let changed = fs::metadata(source).and_then(|m| m.modified());
        if changed.is_ok_and(|changed| changed > built) {
            panic!(
                "the firmware image {} is older than {source}: run tests/build-firmware",
                image.display()
            );
        }
    }
    image
}
