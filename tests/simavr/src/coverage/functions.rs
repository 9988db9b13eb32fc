//! Recognises the kernel's functions by their names.

/// The kernel's crate, and the prefix of its assembly functions.
const KERNEL: &str = "kernel";
const ASSEMBLY: &str = "kernel_";

/// Crates whose types and functions are the same in each program.
const COMMON: [&str; 2] = [KERNEL, "core"];

/// Whether a function of the kernel is assembly.
pub fn is_assembly(name: &str) -> bool {
    name.starts_with(ASSEMBLY)
}

/// The name of a function of the kernel without the parts that differ between programs: types of other
/// crates, and sizes, become `_`. `None` for a function that is not the kernel's, or has a function of
/// another crate inlined.
pub fn name_in_kernel(demangled: &str) -> Option<String> {
    if is_assembly(demangled) {
        return Some(demangled.to_owned());
    }
    let root = words(demangled).find(|word| is_path(word)).map(root);
    if root != Some(KERNEL) {
        return None;
    }
    words(demangled).map(in_all_programs).collect()
}

/// The parts of a name: paths and other words, and the characters between them.
fn words(name: &str) -> impl Iterator<Item = &str> {
    let is_of_word = |char: char| char.is_alphanumeric() || "_:{}#".contains(char);
    name.as_bytes()
        .chunk_by(move |&one, &other| is_of_word(one.into()) == is_of_word(other.into()))
        .map(|word| str::from_utf8(word).unwrap_or_default())
}

/// Whether the word begins a path, and does not continue one.
fn is_path(word: &str) -> bool {
    word.contains("::") && !word.starts_with("::")
}

fn root(path: &str) -> &str {
    path.split("::").next().unwrap_or_default()
}

/// `None` for a function or a closure of another crate.
fn in_all_programs(word: &str) -> Option<&str> {
    if word.starts_with(|char: char| char.is_ascii_digit()) {
        return Some("_"); // a size
    }
    if !is_path(word) || COMMON.contains(&root(word)) {
        return Some(word);
    }
    let is_type = word.rsplit("::").next()?.starts_with(|char: char| char.is_uppercase());
    is_type.then_some("_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_kernels_or_not() {
        for (name, in_kernel) in [
            ("kernel_signal", Some("kernel_signal")),
            ("kernel::arch::avr::start::run", Some("kernel::arch::avr::start::run")),
            ("<kernel::semaphore::Semaphore>::wait", Some("<kernel::semaphore::Semaphore>::wait")),
            (
                "<kernel::queue::Queue<sweep_queue::Reading>>::send::<kernel::context::Task>",
                Some("<kernel::queue::Queue<_>>::send::<kernel::context::Task>"),
            ),
            ("<kernel::fifo::Fifo<32>>::put", Some("<kernel::fifo::Fifo<_>>::put")),
            (
                "<kernel::semaphore::Semaphore>::try_wait::<kernel::context::Task>::{closure#0}",
                Some("<kernel::semaphore::Semaphore>::try_wait::<kernel::context::Task>::{closure#0}"),
            ),
            ("kernel::arch::avr::start::enter::<semaphore::main::{closure#0}>", None),
            ("kernel::arch::avr::start::enter::<flood::body>", None),
            ("<board::tick::Tick as kernel::tickless::TickTimer>::start", None),
            ("core::ptr::drop_in_place::<kernel::pool::Message<queue::Reading>>", None),
            ("semaphore::main::{closure#0}", None),
            ("__vector_15", None),
            ("main", None),
        ] {
            assert_eq!(name_in_kernel(name).as_deref(), in_kernel, "{name}");
        }
    }
}
