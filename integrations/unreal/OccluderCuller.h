// Hides, frame by frame, the actors that the occluders of a scene hide from the camera.
//
// Copy it with OccluderCuller.cpp, occluder_tree.h and occluder_buffer.h (integrations/c) into a module of
// the game, place one actor of it, and name the file that `occluder scene` wrote of the level's GLB
// (scene.occs, below Content, and among the directories to package). Actors are known by their names, which
// have to be those of the file's objects. It tests on one thread of the processor before the frame is
// drawn. What is hidden so casts no shadow either: leave out (tag "KeepShadow") what has to.

#pragma once

#include "CoreMinimal.h"
#include "GameFramework/Actor.h"

#include "occluder_buffer.h"
#include "occluder_tree.h"

#include "OccluderCuller.generated.h"

UCLASS()
class AOccluderCuller : public AActor
{
    GENERATED_BODY()

public:
    AOccluderCuller();

    // scene.occs, relative to Content.
    UPROPERTY(EditAnywhere, Category = "Occluders")
    FString File;

    // Occluder triangles to draw in a frame; 0 for as many as it takes.
    UPROPERTY(EditAnywhere, Category = "Occluders")
    int32 MostTriangles = 0;

    virtual void BeginPlay() override;
    virtual void Tick(float DeltaSeconds) override;

private:
    void FindActors();
    bool Look(occluder_view &View) const;

    occluder_tree Tree;
    occluder_buffer Buffer;
    TArray<uint8> Bytes, Pixels, Room, Verdicts;
    TArray<AActor *> Actors; // of each object; null where there is none of its name
};
