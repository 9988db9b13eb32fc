//! Tables in program memory: their lengths and elements, by array and by slice.

use kernel::flash::Flash;

kernel::flash! {
    static THREE: [u16; 3] = [7, 8, 9];
    static NONE: [u16; 0] = [];
}

#[test]
fn a_table_has_its_elements_and_no_more() {
    assert_eq!((THREE.len(), THREE.is_empty()), (3, false));
    assert_eq!([0, 1, 2, 3].map(|index| THREE.get(index)), [Some(7), Some(8), Some(9), None]);
    assert_eq!(THREE.iter().collect::<Vec<_>>(), [7, 8, 9]);
    assert_eq!((NONE.len(), NONE.is_empty(), NONE.get(0)), (0, true, None));
}

#[test]
fn so_it_has_as_a_slice() {
    let (three, none): (&Flash<[u16]>, &Flash<[u16]>) = (&THREE, &NONE);
    assert_eq!((three.len(), three.is_empty()), (3, false));
    assert_eq!([0, 1, 2, 3].map(|index| three.get(index)), [Some(7), Some(8), Some(9), None]);
    assert_eq!((none.len(), none.is_empty(), none.get(0)), (0, true, None));
}
