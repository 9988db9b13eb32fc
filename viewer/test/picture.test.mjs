// The README's picture is what the robot looks like.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { difference, taken } from "./picture.mjs";

const README = readFileSync(new URL("../../docs/robot.png", import.meta.url));

test("the README's picture is that of today's run, but for some millimetres", async () => {
    const share = await difference(await taken(), README, 48);
    assert.ok(share < 0.03, `${(100 * share).toFixed(1)} % of its pixels differ: look at the robot, and if it is as it should be, ./x picture`);
});
