//! The limits of the figures, and the figures of other kernels for the ATmega128.
//!
//! The peers' figures were measured once, in simavr as ours are: single-stepped, ATmega128 at 16 MHz, built
//! by avr-gcc 5.4.0 with -Os, without the marks, with the 4 cycles of interrupt response. If a peer has two
//! ways to do the same, the better one is given. The flash of a peer is that of its own functions, as linked,
//! without the code that scmRTOS's templates become in the program.

/// A figure of the kernel.
#[derive(Clone, Copy, Debug)]
pub struct Figure {
    /// Its name says the unit: cycles, bytes or instructions.
    pub name: &'static str,
    /// The figure must not exceed this; `None` for a figure that is only shown beside another.
    pub limit: Option<u64>,
    /// The figures of [`PEERS`], in that order; `None` for a peer that has no such function or was not
    /// measured.
    pub peers: [Option<u16>; PEERS.len()],
}

/// A kernel that was measured.
#[derive(Clone, Copy, Debug)]
pub struct Peer {
    /// Short, for a table's heading.
    pub name: &'static str,
    pub version: &'static str,
}

/// The kernels that were measured.
pub const PEERS: [Peer; 10] = [
    Peer { name: "AvrX", version: "AvrX 2.6f" },
    Peer { name: "FreeRTOS", version: "FreeRTOS V11.1.0, ATMega323 port" },
    Peer { name: "RT", version: "ChibiOS/RT 8.0.0" },
    Peer { name: "NIL", version: "ChibiOS/NIL 4" },
    Peer { name: "scm0", version: "scmRTOS, scheme 0, its flash without templates" },
    Peer { name: "scm1", version: "scmRTOS, scheme 1 (SPM interrupt), the same" },
    Peer { name: "atom", version: "atomthreads" },
    Peer { name: "uC/OS", version: "uC/OS-II 2.91" },
    Peer { name: "AVRTOS", version: "AVRTOS on the ATmega328P, with LTO; it has no priorities" },
    Peer { name: "BeRTOS", version: "BeRTOS" },
];

/// A figure, its limit, and the figures of [`PEERS`] in that order; 0 stands for `None`.
const fn figure(name: &'static str, limit: u64, peers: [u16; PEERS.len()]) -> Figure {
    let mut known = [None; PEERS.len()];
    let mut peer = 0;
    while peer < known.len() {
        if peers[peer] > 0 {
            known[peer] = Some(peers[peer]);
        }
        peer += 1;
    }
    let limit = if limit > 0 { Some(limit) } else { None };
    Figure { name, limit, peers: known }
}

/// Every figure.
#[rustfmt::skip]
pub const FIGURES: [Figure; 32] = [
    //                                        limit  AvrX FreeR   RT  NIL scm0 scm1 atom uC/OS AVRTOS BeRTOS
    figure("yield_cycles",                        130, [339,  250, 225,   0,   0,   0,  293,    0, 159, 252]),
    figure("post_to_higher_cycles",               140, [340,  568, 271, 218, 296, 342,  519,  525, 272, 289]),
    figure("post_by_call_to_higher_cycles",         0, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("block_to_lower_cycles",               150, [306,  726, 210, 184, 313, 359,  382,  461, 241, 233]),
    figure("block_to_preempted_cycles",             0, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("post_cycles",                          20, [ 41,  152,  29,  49,  36,  36,   48,   77,  42,  56]),
    figure("wait_cycles",                          15, [ 24,   91,  39,  33,  79,  79,   93,  112,  10,  55]),
    figure("isr_to_task_cycles",                  185, [343,  610, 421, 268, 327, 397,  603,  647, 327, 476]),
    figure("message_to_higher_cycles",            200, [455,  774, 605, 434, 352, 398, 1076,  550, 365,   0]),
    figure("message_send_cycles",                  55, [287,  210, 177,   0,  59,  59,  505,  123,   0,   0]),
    figure("message_receive_cycles",               40, [ 83,  173, 174,   0,  47,  47,  503,  145,   0,   0]),
    figure("tick_cycles_0",                        40, [282,  271, 152, 164, 163, 163,  285,  324, 131, 177]),
    figure("tick_cycles_1",                        40, [294,  271, 172, 190, 191, 191,  321,  384,   0, 208]),
    figure("tick_cycles_10",                       40, [294,  271, 172, 424, 418, 418,  645,  924,   0, 208]),
    figure("tick_cycles_50",                       40, [294,  271, 172,   0,   0,   0, 2085,    0,   0, 208]),
    figure("tick_to_task_cycles",                 285, [429,  559, 535, 306, 335, 335,  649,  521,   0, 653]),
    figure("tick_to_task_by_timer_cycles",          0, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("tick_to_task_by_timeout_cycles",        0, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("masked_cycles_kernel",                100, [808,  596, 601, 430, 353, 217,  395,  306, 280, 263]),
    figure("masked_cycles_kernel_usual",            0, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("masked_cycles_isr",                   160, [343,  593, 531, 562, 484, 403, 2407, 1117, 327, 610]),
    figure("masked_cycles_isr_usual",               0, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("task_bytes",                            6, [  6,   38,  36,  10,   6,   6,   18,   21,  18,  14]),
    figure("semaphore_bytes",                       2, [  2,   31,   5,   1,   3,   3,    3,    8,   6,  12]),
    figure("timer_bytes",                           6, [  6,   19,  12,   0,   0,   0,   10,    0,   8,  19]),
    figure("message_bytes",                         2, [  4,    0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("preempted_context_bytes",              35, [ 35,   58,  42,  40,  54,  38,   45,   56,  57,  64]),
    figure("kernel_flash_bytes",                 3000, [1062, 6742, 3072, 1532, 982, 982, 3538, 3762,  0, 2036]),
    figure("kernel_flash_bytes_with_calls",         0, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("kernel_flash_bytes_all",             4500, [1908,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("kernel_flash_bytes_all_with_calls",     0, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
    figure("assembly_instructions",               300, [   0,   0,   0,   0,   0,   0,    0,    0,   0,   0]),
];
