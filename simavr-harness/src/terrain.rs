//! Converts a robot file's table `[world]` to the world's types.

use simulation::{Block, Stair, Terrain, Wall};
use world::assumed::{FRICTION, MODULE_MASS};
use world::{Ground, Make, Steps};

/// The thickness of walls, in m.
const WALL: f64 = 0.05;

/// Millimetres in a metre.
const MILLI: f64 = 1e-3;

/// The ground of a terrain.
pub fn ground(terrain: &Terrain) -> Ground {
    let steps = |&Stair { from_m, height_mm, length_mm, number }: &Stair| Steps {
        from: from_m,
        height: height_mm * MILLI,
        length: length_mm * MILLI,
        number,
    };
    Ground {
        friction: terrain.friction.unwrap_or(FRICTION),
        slope: terrain.slope_degrees,
        steps: terrain.steps.as_ref().map(steps),
        blocks: terrain.boxes.iter().map(block).chain(terrain.walls.iter().map(wall)).collect(),
    }
}

fn block(&Block { at_m, size_mm, turned_degrees }: &Block) -> world::Block {
    world::Block { at: at_m, size: size_mm.map(|edge| edge * MILLI), turn: turned_degrees }
}

fn wall(&Wall { from_m: [x, y], to_m: [to_x, to_y], height_mm }: &Wall) -> world::Block {
    let [along, across] = [to_x - x, to_y - y];
    world::Block {
        at: [(x + to_x) / 2.0, (y + to_y) / 2.0],
        size: [along.hypot(across) + WALL, WALL, height_mm * MILLI],
        turn: across.atan2(along).to_degrees(),
    }
}

/// The makes of `modules` modules, with the loads that the terrain gives them.
pub(crate) fn makes(terrain: &Terrain, modules: usize) -> Vec<Make> {
    let make = |module| {
        let loads = terrain.loads.iter().filter(|load| load.module == module);
        let load: f64 = loads.map(|load| load.kg).sum();
        Make { mass: terrain.module_kg.unwrap_or(MODULE_MASS) + load, ..Make::default() }
    };
    (0..modules).map(make).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_stands_on_both_of_its_ends() {
        let wall = wall(&Wall { from_m: [1.0, 1.0], to_m: [1.0, 3.0], height_mm: 200.0 });
        assert_eq!(wall, world::Block { at: [1.0, 2.0], size: [2.0 + WALL, WALL, 0.2], turn: 90.0 });
    }
}
