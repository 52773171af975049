//! Units that wavelengths are given in by mistake for nm.

/// What wavelengths from `first` to `last` are probably in, if not in nm; `None` where some of them lie within 300 to 2500 nm, which films may reach.
fn suspected_unit(first: f64, last: f64) -> Option<&'static str> {
    if first <= 0.0 {
        return None;
    }
    match last {
        last if last < 1e-5 => Some("metres"),
        last if last < 0.1 => Some("millimetres"),
        last if last < 300.0 && first < 100.0 => Some("micrometres"),
        _ if first > 2500.0 => Some("angstroms"),
        _ => None,
    }
}

/// The line that says so of wavelengths from `first` to `last`.
pub fn unit_problem(first: f64, last: f64) -> Option<String> {
    let unit = suspected_unit(first, last)?;
    Some(if first == last {
        format!("a wavelength of {first} nm: this looks like {unit}")
    } else {
        format!("wavelengths from {first} to {last} nm: these look like {unit}")
    })
}
