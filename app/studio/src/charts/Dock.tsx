import { signal } from "@preact/signals";
import { Tabs } from "../ui/Tabs";
import { alone } from "../store/alone";
import { answered, stale } from "../store/state";
import { Front } from "./Front";
import { Joints } from "./Joints";
import { LegTimeline } from "./LegTimeline";
import { Limits } from "./Limits";
import { Power } from "./Power";

type View = "power" | "front" | "limits";
const view = signal<View>("power");

const VIEWS: { value: View; text: string }[] = [
  { value: "power", text: "Power, W" },
  { value: "front", text: "Energy over time" },
  { value: "limits", text: "Use of limits" },
];

/** Charts under the picture; they share its clock. */
export function Dock() {
  const shown = answered.value;
  if (!shown) return null;
  const options = VIEWS.filter(({ value }) => value !== "front" || (!alone && !shown.cycle));
  const now = options.some(({ value }) => value === view.value) ? view.value : "power";
  return (
    <section class={`dock${stale.value ? " stale" : ""}`} aria-label="Charts" id="figures">
      {stale.value && <p class="old">not up to date</p>}
      {shown.cycle && <LegTimeline cycle={shown.cycle} />}
      <div class="charts">
        <div class="chart">
          <Tabs
            label="First chart"
            options={options}
            value={now}
            onChange={(next) => (view.value = next)}
            controls="first-chart"
          />
          <div id="first-chart" role="tabpanel" aria-label="First chart">
            {now === "power" && <Power />}
            {now === "front" && <Front />}
            {now === "limits" && <Limits />}
          </div>
        </div>
        <div class="chart">
          <Joints />
        </div>
      </div>
    </section>
  );
}
