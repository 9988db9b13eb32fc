use simavr_harness::*;
use superbot_tests_simavr::MILLISECOND;
use superbot_tests_simavr::chain::*;
use superbot_tests_simavr::hormones::*;
#[test]
fn long() {
    for p in [0.0, 0.3, 0.6] { for seed in 1..8 {
        let mut chain = Chain::new(5, seed);
        chain.lose_frames(p);
        let mut t=0;
        while chain.robot().crashes().count() == 0 && t < 40_000 { chain.run(10*MILLISECOND); t += 10; }
        println!("{p} {seed} {t} {:?}", chain.robot().crashes().collect::<Vec<_>>());
    }}
}
