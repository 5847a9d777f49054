//! What an overrun policy makes of releases that are due together.

use crate::rate_group::OverrunPolicy;

/// What to do after the wait for release `next`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decision {
    /// Run this release; the ones from `next` up to it, `skipped` in number, are given up.
    Run { release: u64, skipped: u64 },
    /// Give up all releases that are due, `skipped` in number, and stop.
    Stop { skipped: u64 },
}

/// Decides what to do when `next` is to run and `latest >= next` is the latest release due.
pub(crate) fn decide(policy: OverrunPolicy, next: u64, latest: u64) -> Decision {
    let backlog = latest - next;
    match policy {
        OverrunPolicy::Skip | OverrunPolicy::Rephase | OverrunPolicy::Degrade { .. } => {
            Decision::Run { release: latest, skipped: backlog }
        }
        OverrunPolicy::CatchUp { max } => {
            let skipped = backlog.saturating_sub(u64::from(max));
            Decision::Run { release: next + skipped, skipped }
        }
        OverrunPolicy::Stop if backlog == 0 => Decision::Run { release: latest, skipped: 0 },
        OverrunPolicy::Stop => Decision::Stop { skipped: backlog + 1 },
    }
}

#[cfg(all(test, not(loom)))]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub(crate) fn policies() -> impl Strategy<Value = OverrunPolicy> {
        prop_oneof![
            Just(OverrunPolicy::Skip),
            (1_u32..5).prop_map(|max| OverrunPolicy::CatchUp { max }),
            Just(OverrunPolicy::Rephase),
            (1_u32..5).prop_map(|recover_after| OverrunPolicy::Degrade { recover_after }),
            Just(OverrunPolicy::Stop)
        ]
    }

    proptest! {
        #[test]
        fn a_decision_accounts_for_every_period(policy in policies(), next in 0_u64..1 << 60, backlog in 0_u64..1000) {
            let latest = next + backlog;
            match decide(policy, next, latest) {
                Decision::Run { release, skipped } => {
                    // Check that skipped and run are exactly the periods next..=release, and nothing in the future
                    prop_assert_eq!(next + skipped, release);
                    prop_assert!(release <= latest);
                    let waiting = latest - release;
                    match policy {
                        OverrunPolicy::CatchUp { max } => prop_assert!(
                            waiting <= u64::from(max) && (skipped == 0 || waiting == u64::from(max))
                        ),
                        OverrunPolicy::Stop => prop_assert_eq!(backlog, 0),
                        _ => prop_assert_eq!(waiting, 0),
                    }
                }
                Decision::Stop { skipped } => {
                    prop_assert_eq!(policy, OverrunPolicy::Stop);
                    prop_assert!(backlog > 0);
                    prop_assert_eq!(skipped, backlog + 1);
                }
            }
        }
    }
}
