import { effect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type uPlot from "uplot";
import { goTo } from "../picture/clock";
import { dark } from "../ui/dark";
import { time } from "../store/state";
import { plot, type PlotOptions } from "./plot";

interface Props {
  id: string;
  label: string;
  series: uPlot.Series[];
  data: uPlot.AlignedData;
  options: PlotOptions;
  /** Whether the clock is a line in it, which a drag moves. */
  clocked?: boolean;
  /** Puts more into the area of the curves. */
  over?: (chart: uPlot) => void;
}

/** A chart that is drawn anew when its data, its width or the theme change. */
export function Chart({ id, label, series, data, options, clocked, over }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const scheme = dark.value;
  useEffect(() => {
    const element = box.current!;
    const drawn = plot(element, series, data, options);
    if (clocked) follow(drawn);
    over?.(drawn);
    const stop = clocked ? cursor(drawn) : () => undefined;
    const widths = new ResizeObserver(() =>
      requestAnimationFrame(
        () =>
          element.clientWidth &&
          drawn.setSize({ width: Math.max(120, element.clientWidth), height: drawn.height }),
      ),
    );
    widths.observe(element);
    return () => {
      stop();
      widths.disconnect();
      drawn.destroy();
    };
  }, [data, scheme, series.length, JSON.stringify(series.map(({ show }) => show))]);
  return <div class="plot" id={id} ref={box} role="img" aria-label={label} />;
}

/** A click or a drag sets the time of everything. */
function follow({ over, posToVal }: uPlot): void {
  const seek = (event: PointerEvent) =>
    goTo(posToVal(event.clientX - over.getBoundingClientRect().left, "x"));
  over.classList.add("clocked");
  over.onpointerdown = (event) => {
    over.setPointerCapture(event.pointerId);
    seek(event);
  };
  over.onpointermove = (event) => {
    if (event.buttons) seek(event);
  };
}

/** The clock as a line; returns what ends it. */
function cursor(drawn: uPlot): () => void {
  const line = Object.assign(document.createElement("div"), { className: "now" });
  drawn.over.append(line);
  const move = () => (line.style.transform = `translateX(${drawn.valToPos(time.value, "x")}px)`);
  drawn.hooks.setSize = [move];
  return effect(() => void move());
}
