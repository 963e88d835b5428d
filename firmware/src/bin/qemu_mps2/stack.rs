//! How deep the stack went: the memory below it is painted at the start and looked at later.

unsafe extern "C" {
    /// Where the stack begins; only its address means anything.
    static _stack_start: u32;
}

/// More than the real board has in all.
const PAINTED_BYTES: usize = 128 * 1024;
/// The frame of the painting function itself.
const SPARED_BYTES: usize = 256;
const PAINT: u32 = 0xdead_beef;

fn top() -> *mut u32 {
    (&raw const _stack_start).cast_mut()
}

fn bottom() -> *mut u32 {
    top().wrapping_byte_sub(PAINTED_BYTES)
}

/// Paints what lies below the stack as it is now.
///
/// # Safety
/// Must be called with interrupts off and at most some kilobytes deep.
pub(crate) unsafe fn paint() {
    let now = cortex_m::register::msp::read() as usize - SPARED_BYTES;
    let mut word = bottom();
    while word.addr() < now {
        // SAFETY: below the stack pointer, above all statics: nothing else is there.
        unsafe { word.write_volatile(PAINT) };
        word = word.wrapping_add(1);
    }
}

/// The most bytes of stack that were in use since [`paint`].
pub(crate) fn most_bytes() -> usize {
    let mut word = bottom();
    // SAFETY: reads memory that exists, and was written.
    while word < top() && unsafe { word.read_volatile() } == PAINT {
        word = word.wrapping_add(1);
    }
    top().addr() - word.addr()
}
