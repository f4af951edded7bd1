import { useEffect } from "preact/hooks";
import { trouble } from "../store/state";
import { Answers } from "./Answers";
import { OwnRobots } from "./OwnRobots";
import { Studies } from "./Studies";

/** What the service keeps: answers, studies, and robots of one's own. */
export function LibraryPage() {
  useEffect(() => {
    trouble.value = null;
  }, []);
  return (
    <main class="page" id="library">
      {trouble.value && (
        <p class="error" role="alert" id="problem">
          {trouble.value.text}
        </p>
      )}
      <div class="columns">
        <Answers />
        <Studies />
        <OwnRobots />
      </div>
    </main>
  );
}
