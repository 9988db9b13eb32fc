// A module as rigid bodies, as plants/src/geometry.rs has it: x to the Front, y to the Left, z to the Up.
// In metres.

import { Matrix4, Quaternion, Vector3 } from "three";

export const EDGE = 0.084;

const HALF = EDGE / 2;
const radians = (degrees) => (degrees * Math.PI) / 180;

/** By number: the half that has the dock, and which way it points out of that. */
const DOCKS = [
    { isFront: true, out: new Vector3(1, 0, 0) },
    { isFront: false, out: new Vector3(-1, 0, 0) },
    { isFront: true, out: new Vector3(0, 1, 0) },
    { isFront: true, out: new Vector3(0, -1, 0) },
    { isFront: false, out: new Vector3(0, 0, 1) },
    { isFront: false, out: new Vector3(0, 0, -1) },
];

for (const dock of DOCKS) dock.turned = new Quaternion().setFromUnitVectors(new Vector3(1, 0, 0), dock.out);

const MOVE = new Matrix4();

/** The frames of a module's four parts: both at the roll, and both halves with docks. */
export function parts(
    { frame, angles: [front, roll, back] },
    into = Array.from({ length: 4 }, () => new Matrix4()),
) {
    const [frontRoll, backRoll, frontHalf, backHalf] = into;
    frontRoll.copy(frame).multiply(MOVE.makeTranslation(HALF, 0, 0));
    frontHalf.copy(frontRoll).multiply(MOVE.makeRotationY(-radians(front)));
    backRoll
        .copy(frame)
        .multiply(MOVE.makeRotationX(radians(roll)))
        .multiply(MOVE.makeTranslation(-HALF, 0, 0));
    backHalf.copy(backRoll).multiply(MOVE.makeRotationY(radians(back)));
    return into;
}

/** The middle of a dock's face. */
export function dock(number, [, , frontHalf, backHalf], into = new Vector3()) {
    const { isFront, out } = DOCKS[number];
    return into
        .copy(out)
        .multiplyScalar(HALF)
        .applyMatrix4(isFront ? frontHalf : backHalf);
}

/** How a dock is turned: its x points outwards. */
export function turn(number, [, , frontHalf, backHalf], into = new Quaternion()) {
    const { isFront, turned } = DOCKS[number];
    return into.setFromRotationMatrix(isFront ? frontHalf : backHalf).multiply(turned);
}
