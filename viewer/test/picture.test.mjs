// The README's picture is what the robot looks like.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Browser } from "./browser.mjs";
import { MOST, README, changed } from "./picture.mjs";

test("the README's picture is that of today's run, but for some millimetres", async () => {
    const browser = await Browser.start();
    try {
        const share = await changed(README, browser);
        const advice = "look at the robot, and if it is as it should be, make it anew by ./x picture";
        assert.ok(share < MOST, `${(100 * share).toFixed(1)} % of its pixels differ: ${advice}`);
    } finally {
        await browser.end();
    }
});
