//! Memory addresses of the firmware images. An image that is linked for another board builds but does not run.
#![allow(clippy::expect_used, clippy::panic)]

use std::fs;
use std::ops::Range;
use std::path::Path;

use object::{Object, ObjectSection, ObjectSegment, ObjectSymbol, SectionKind};
use quietcut_tests::firmware_image;

/// The addresses of an image that the start-up code and the linker script must agree on.
struct Image {
    segments: Vec<Range<u64>>,
    vector_table: u64,
    entry: u64,
    stack_start: u64,
    symbols: Vec<(String, u64)>,
}

impl Image {
    fn read(path: &Path) -> Self {
        let bytes = fs::read(path).expect("the image");
        let elf = object::File::parse(&*bytes).expect("an ELF file");
        let symbols: Vec<_> = elf
            .symbols()
            .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.address())))
            .collect();
        let table = elf.section_by_name(".vector_table").expect("a vector table");
        let first_word = table.data().expect("bytes")[..4].try_into().expect("4 bytes");
        let sum = |kinds: &[SectionKind]| -> u64 {
            elf.sections()
                .filter(|s| kinds.contains(&s.kind()))
                .map(|s| s.size())
                .sum()
        };
        println!(
            "{}: {} bytes of code and constants, {} bytes of static memory",
            path.display(),
            sum(&[SectionKind::Text, SectionKind::ReadOnlyData, SectionKind::Data]),
            sum(&[SectionKind::Data, SectionKind::UninitializedData]),
        );
        Self {
            segments: elf
                .segments()
                .filter(|segment| segment.size() > 0)
                .map(|segment| segment.address()..segment.address() + segment.size())
                .collect(),
            vector_table: table.address(),
            entry: elf.entry(),
            stack_start: u64::from(u32::from_le_bytes(first_word)),
            symbols,
        }
    }

    fn symbol(&self, name: &str) -> u64 {
        let found = self.symbols.iter().find(|(symbol, _)| symbol == name);
        found.unwrap_or_else(|| panic!("no symbol {name}")).1
    }

    /// Checks that every segment is in flash or memory, the vector table at the start of flash, and the stack at the end of
    /// memory.
    fn assert_within(&self, flash: Range<u64>, memory: Range<u64>) {
        assert!(!self.segments.is_empty());
        for segment in &self.segments {
            let inside = |place: &Range<u64>| place.start <= segment.start && segment.end <= place.end;
            assert!(
                inside(&flash) || inside(&memory),
                "a segment lies at {segment:#x?}"
            );
        }
        assert_eq!(self.vector_table, flash.start, "vector table");
        assert!(flash.contains(&self.entry), "entry at {:#x}", self.entry);
        assert!(
            memory.contains(&(self.stack_start - 8)) || self.stack_start == memory.end,
            "stack at {:#x}",
            self.stack_start
        );
    }
}

#[test]
fn the_emulators_image_lies_in_its_memory() {
    for path in [firmware_image::qemu_mps2(), firmware_image::count_instructions()] {
        Image::read(&path).assert_within(0..0x40_0000, 0x2000_0000..0x2040_0000);
    }
}

#[test]
fn the_boards_image_lies_in_its_first_bank_and_the_tables_in_the_second() {
    let image = Image::read(&firmware_image::nucleo_g474re());
    image.assert_within(0x0800_0000..0x0804_0000, 0x2000_0000..0x2002_0000);
    assert_eq!(image.symbol("__table_slots_start"), 0x0804_0000);
    assert_eq!(image.symbol("__table_slots_end"), 0x0808_0000);
}
