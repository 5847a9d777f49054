//! What model reduction costs: `cargo bench --bench reduction`, on one core. With `-- --json` the same as one line, for
//! `benches/rivals/balance.py`; `-- --cells N` takes another mesh for the balancing.

fn main() {
    palpate_cli::reduction_costs();
}
