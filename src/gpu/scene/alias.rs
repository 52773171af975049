//! Choice among weighted entries in one step.

/// The alias table of these weights (Vose 1991): probability, threshold and alias of each.
pub(super) fn alias_table(weights: &[f64]) -> Vec<(f64, f64, u32)> {
    let n = weights.len();
    let total: f64 = weights.iter().sum();
    let mut out: Vec<(f64, f64, u32)> =
        weights.iter().enumerate().map(|(i, w)| (if total > 0.0 { w / total } else { 1.0 / n as f64 }, 1.0, i as u32)).collect();
    let mut scaled: Vec<f64> = out.iter().map(|o| o.0 * n as f64).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    while let (Some(s), Some(&l)) = (small.pop(), large.last()) {
        out[s].1 = scaled[s];
        out[s].2 = l as u32;
        scaled[l] -= 1.0 - scaled[s];
        if scaled[l] < 1.0 {
            large.pop();
            small.push(l);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::alias_table;

    #[test]
    fn an_alias_table_chooses_each_entry_with_its_probability() {
        let weights = [3.0, 0.0, 1.0, 0.5, 7.5];
        let table = alias_table(&weights);
        let mut chosen = [0.0; 5];
        for (i, (_, threshold, alias)) in table.iter().enumerate() {
            chosen[i] += threshold / 5.0;
            chosen[*alias as usize] += (1.0 - threshold) / 5.0;
        }
        for (c, w) in chosen.iter().zip(weights) {
            assert!((c - w / 12.0).abs() < 1e-12, "{chosen:?}");
        }
    }
}
